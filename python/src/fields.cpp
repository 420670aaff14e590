// Radiance fields: load, train, render, compare with the ground truth.
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/nerf/trainer.h>
#include <pybind11/functional.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "field_handle.h"

namespace fieldmark::python {
namespace {

using namespace py::literals;
using nerf::Camera;
using nerf::RadianceField;

constexpr Index kQuiet = 25;  // steps between checks for Ctrl-C

Camera camera_from(const py::object& given, double fov, Index width, Index height) {
  const py::array pose = borrowed<double>("Camera: pose", given);
  if (shape_of(pose) != Shape{3, 4} && shape_of(pose) != Shape{4, 4})
    throw ShapeError("[Camera] pose must be [3, 4] or [4, 4], camera to world, got shape " +
                     shape_of(pose).str());
  nerf::Pose p;
  std::copy_n(elements<double>(pose).begin(), p.size(), p.begin());
  return nerf::make_camera(p, fov, width, height);
}

// Moves the tensor's memory into an array.
py::array_t<float> array_of(Tensor<float>&& tensor) {
  auto* kept = new Tensor<float>(std::move(tensor));
  return py::array_t<float>(extents_of(kept->shape), kept->data.data(),
                            py::capsule(kept, [](void* p) { delete static_cast<Tensor<float>*>(p); }));
}

std::shared_ptr<RadianceField> train(const std::filesystem::path& data, double seconds, Index steps,
                                     Index size, std::uint64_t seed, const py::object& progress) {
  nerf::TrainOptions options = nerf::train_options(nerf::FieldKind::hash);
  options.schedule.seconds = seconds;
  options.schedule.steps = steps;
  options.seed = seed;
  const nerf::Dataset set = unlocked([&] { return nerf::load_dataset(data, {.size = size}); });
  auto field = std::make_shared<RadianceField>(nerf::field_options(options.schedule));
  nerf::Trainer trainer(*field, set, options);
  run(trainer, progress);
  return field;
}

py::dict evaluate(const RadianceField& field, const std::filesystem::path& data, const std::string& split,
                  Index size) {
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
  py::class_<Camera>(module, "Camera")
      .def(
          py::init(&camera_from), "pose"_a, "fov"_a, "width"_a, "height"_a,
          "A centred pinhole camera: pose [3, 4] from camera to world, x right, y up, looking along -z; fov\n"
          "is the horizontal field of view in radians.")
      .def_readonly("width", &Camera::width)
      .def_readonly("height", &Camera::height)
      .def_property_readonly("pose",
                             [](const Camera& c) {
                               return py::array_t<double>({3, 4}, c.pose.data());
                             })
      .def(
          "scaled", [](const Camera& c, Index size) { return c.scaled(size); }, "size"_a,
          "The same view with this many pixels on the longer side.");
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

void run(TrainingRun& training, const py::object& progress) {
  unlocked([&] {
    return training.drive({.after = [&](double seconds) {
      if (training.steps() % kQuiet != 0) return;
      const py::gil_scoped_acquire held;
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (!progress.is_none()) progress(training.steps(), seconds);
    }});
  });
}

void bind_fields(py::module_& module) {
  bind_camera(module);
  py::class_<RadianceField, std::shared_ptr<RadianceField>>(module, "Field")
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
            return nerf::make_cameras(f.cameras, nerf::parse_camera_set(set), count, size, seed);
          },
          "count"_a, "set"_a = "novel", "size"_a = 0, "seed"_a = 0,
          "Cameras about the scene: novel, ring, sphere, extrapolated, closer or farther.")
      .def(
          "render",
          [](const RadianceField& f, const Camera& camera) {
            return array_of(unlocked([&] {
              nerf::Renderer renderer(f);
              return std::move(renderer.render(camera).rgb);
            }));
          },
          "camera"_a, "An image [height, width, 3] in [0, 1].")
      .def("evaluate", &evaluate, "data"_a, "split"_a = "test", "size"_a = 0,
           "Mean PSNR in dB and SSIM over the views of a split.");
  module.def("train", &train, "data"_a, "seconds"_a, "steps"_a, "size"_a, "seed"_a, "progress"_a);
}

}  // namespace fieldmark::python
