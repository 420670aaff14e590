// Radiance fields: load, train, render, compare with the ground truth.
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/collapse_watch.h>
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/nerf/trainer.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "field_handle.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;
using nerf::Camera;
using nerf::RadianceField;

constexpr Index kQuiet = 25;  // steps between checks for Ctrl-C

constexpr Index kMostSide = 65536;  // pixels of an image: its elements' bytes are then an integer of 64 bits

Camera camera_from(const py::object& given, double fov, Index width, Index height) {
  const py::array pose = borrowed<double>("Camera: pose", given);
  const auto numbers = elements<double>(pose);
  if (shape_of(pose) != Shape{3, 4} && shape_of(pose) != Shape{4, 4})
    throw ShapeError("[Camera] pose must be [3, 4] or [4, 4], camera to world, got shape " +
                     shape_of(pose).str());
  if (!std::ranges::all_of(numbers, [](double x) { return std::isfinite(x); }))
    throw ValueError("[Camera] pose must be finite, got NaN or infinity");
  if (numbers.size() == 16 && !std::ranges::equal(numbers.subspan(12), std::array{0., 0., 0., 1.}))
    throw ValueError("[Camera] pose must end with the row 0, 0, 0, 1, got " +
                     py::str(given[py::int_(3)]).cast<std::string>());
  if (!(fov > 0 && fov < std::numbers::pi))
    throw ValueError("[Camera] fov must be in (0, pi) radians, got " + std::to_string(fov));
  require_within("Camera", "width", width, 1, kMostSide);
  require_within("Camera", "height", height, 1, kMostSide);
  nerf::Pose p;
  std::copy_n(numbers.begin(), p.size(), p.begin());
  return nerf::make_camera(p, fov, width, height);
}

// Moves the tensor's memory into an array.
py::array_t<float> array_of(Tensor<float>&& tensor) {
  auto* kept = new Tensor<float>(std::move(tensor));
  return py::array_t<float>(extents_of(kept->shape), kept->data.data(),
                            py::capsule(kept, [](void* p) { delete static_cast<Tensor<float>*>(p); }));
}

// Takes a few images that are not trained on, or training images if there are no others.
nerf::CollapseWatch collapse_watch(const RadianceField& field, const std::filesystem::path& folder,
                                   const nerf::DatasetOptions& wanted, const nerf::Dataset& set) {
  for (const char* split : {"val", "test"}) {
    if (!nerf::has_split(folder, split)) continue;
    nerf::DatasetOptions few = wanted;
    few.split = split;
    few.background = set.background;
    few.scene = set.scene;
    few.most_views = nerf::CollapseWatch::kViews;
    try {
      return {field, nerf::load_dataset(folder, few)};
    } catch (const Error&) {
      continue;  // training does not need them
    }
  }
  return {field, set};
}

void require_healthy(const std::string& fault, const nerf::Dataset& set, Index steps) {
  if (fault.empty()) return;
  throw Error("[train] training collapsed after " + std::to_string(steps) + " steps: " + fault +
              ". The scene was taken for type " + nerf::name_of(set.scene) + " (" + set.scene_reason +
              "): check that cameras and images belong together");
}

void warn_of(const std::vector<std::string>& notes) {
  constexpr Index kCallerOfTrain = 2;  // the one of fieldmark.train()
  for (const std::string& note : notes)
    if (PyErr_WarnEx(PyExc_UserWarning, note.c_str(), kCallerOfTrain) != 0) throw py::error_already_set();
}

std::shared_ptr<RadianceField> train(const std::filesystem::path& data, double seconds, Index steps,
                                     Index size, std::uint64_t seed, const py::object& progress) {
  nerf::TrainOptions options = nerf::train_options(nerf::FieldKind::hash);
  options.schedule.seconds = seconds;
  options.schedule.steps = steps;
  options.seed = seed;
  const nerf::DatasetOptions wanted{.size = size};
  const nerf::Dataset set = unlocked([&] { return nerf::load_dataset(data, wanted); });
  warn_of(set.notes);
  nerf::RadianceFieldOptions sizes = nerf::field_options(options.schedule);
  sizes.seed = seed;
  std::shared_ptr<RadianceField> field;
  std::optional<nerf::Trainer> trainer;
  std::unique_ptr<nerf::CollapseWatch> watch;
  unlocked([&] {
    field = std::make_shared<RadianceField>(sizes);
    trainer.emplace(*field, set, options);
    watch.reset(new nerf::CollapseWatch(collapse_watch(*field, data, wanted, set)));
  });
  run(*trainer, progress, [&] {
    const Index taken = trainer->steps();
    require_healthy(watch->look(taken, trainer->train_psnr(), trainer->seconds()), set, taken);
  });
  unlocked([&] { require_healthy(watch->verdict(trainer->steps()), set, trainer->steps()); });
  return field;
}

py::dict evaluate(const RadianceField& field, const std::filesystem::path& data, const std::string& split,
                  Index size) {
  require_within("Field.evaluate", "size", size, 0, kMostSide);
  const nerf::Evaluation e = unlocked([&] {
    // The ground truth is composited over what the field renders behind transparent pixels.
    const nerf::Dataset set =
        nerf::load_dataset(data, {.split = split, .size = size, .background = field.background});
    nerf::Renderer renderer(field);
    return nerf::evaluate(renderer, set, check_signals);
  });
  return py::dict("psnr"_a = e.psnr, "ssim"_a = e.ssim);
}

void bind_camera(py::module_& module) {
  py::class_<Camera>(module, "Camera", "A pinhole camera.")
      .def(py::init(&camera_from), "pose"_a, "fov"_a, "width"_a, "height"_a,
           "A centred pinhole camera with square pixels.\n\n"
           ":param pose: float64 [3, 4] from camera to world, or [4, 4] with the last row 0, 0, 0, 1; x "
           "right,\n"
           "    y up, looking along -z\n"
           ":param fov: horizontal field of view in radians, in (0, pi)\n"
           ":param width: pixels, 1 to 65536\n"
           ":param height: pixels, 1 to 65536")
      .def_readonly("width", &Camera::width, "Pixels.")
      .def_readonly("height", &Camera::height, "Pixels.")
      .def_property_readonly(
          "pose",
          [](const Camera& c) {
            return py::array_t<double>({3, 4}, c.pose.data());
          },
          "A copy of the pose, [3, 4] from camera to world.")
      .def(
          "scaled",
          [](const Camera& c, Index size) {
            require_within("Camera.scaled", "size", size, 1, kMostSide);
            return c.scaled(size);
          },
          "size"_a, "The same view with this many pixels on the longer side.");
}

}  // namespace

std::recursive_mutex& library_lock() {
  static std::recursive_mutex lock;
  return lock;
}

bool check_signals(Index /*done*/, Index /*total*/) {
  const py::gil_scoped_acquire held;
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  return true;
}

void run(TrainingRun& training, const py::object& progress, const std::function<void()>& check) {
  unlocked([&] {
    return training.drive({.enough =
                               [&] {
                                 if (check) check();
                                 return false;
                               },
                           .after =
                               [&](double seconds) {
                                 if (training.steps() % kQuiet != 0) return;
                                 const py::gil_scoped_acquire held;
                                 if (PyErr_CheckSignals() != 0) throw py::error_already_set();
                                 if (!progress.is_none()) progress(training.steps(), seconds);
                               }});
  });
}

void bind_fields(py::module_& module) {
  bind_camera(module);
  py::class_<RadianceField, std::shared_ptr<RadianceField>>(module, "Field", "A radiance field.")
      .def_static(
          "load",
          [](const std::filesystem::path& path) {
            return std::make_shared<RadianceField>(RadianceField::load(path));
          },
          "path"_a, "Reads a FIELD file.")
      .def("save", &RadianceField::save, "path"_a, "Writes a FIELD file.")
      .def(
          "cameras",
          [](const RadianceField& f, Index count, const std::string& set, Index size, std::uint64_t seed) {
            require_within("Field.cameras", "count", count, 1);
            require_within("Field.cameras", "size", size, 0, kMostSide);
            return nerf::make_cameras(f.cameras, nerf::parse_camera_set(set), count, size, seed);
          },
          "count"_a, "set"_a = "novel", "size"_a = 0, "seed"_a = 0,
          "Cameras about the scene.\n\n"
          ":param count: how many, at least 1\n"
          ":param set: novel, ring, sphere, extrapolated, closer or farther\n"
          ":param size: pixels of the longer side; 0: as in the training images\n"
          ":param seed: of the random cameras")
      .def(
          "render",
          [](const RadianceField& f, const Camera& camera) {
            return array_of(unlocked([&] {
              nerf::Renderer renderer(f);
              return std::move(renderer.render(camera).rgb);
            }));
          },
          "camera"_a, "An image of float32, [height, width, 3], in [0, 1].")
      .def("evaluate", &evaluate, "data"_a, "split"_a = "test", "size"_a = 0,
           "A dict with psnr in dB and ssim, means over the views of a split.\n\n"
           ":param data: folder of a data set\n"
           ":param split: train, val or test\n"
           ":param size: pixels of the longer side that images are reduced to; 0: as they are");
  module.def("train", &train, "data"_a, "seconds"_a, "steps"_a, "size"_a, "seed"_a, "progress"_a);
}

}  // namespace fieldmark::python
