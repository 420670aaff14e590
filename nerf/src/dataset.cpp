#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/nerf/dataset.h>

#include <algorithm>
#include <exception>

#include "capture.h"
#include "lens.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

// Grey, grey + alpha, RGB or RGBA to RGBA.
Tensor<float> to_rgba(const Tensor<float>& image) {
  const Index pixels = image.shape[0] * image.shape[1], channels = image.shape[2];
  Tensor<float> out(Shape{image.shape[0], image.shape[1], 4});
  const bool grey = channels < 3, alpha = channels % 2 == 0;
  for (Index i = 0; i < pixels; ++i) {
    const float* in = image.data.data() + i * channels;
    for (Index k = 0; k < 3; ++k) out[4 * i + k] = in[grey ? 0 : k];
    out[4 * i + 3] = alpha ? in[channels - 1] : 1.0f;
  }
  return out;
}

// Filters premultiplied colour, so that the colour of transparent pixels does not leak into edges.
Tensor<float> resize_rgba(Tensor<float> image, Index height, Index width) {
  if (image.shape[0] == height && image.shape[1] == width) return image;
  for (Index i = 0; i < image.size(); i += 4)
    for (Index k = 0; k < 3; ++k) image[i + k] *= image[i + 3];
  Tensor<float> out = resize_area(image, height, width);
  for (Index i = 0; i < out.size(); i += 4)
    for (Index k = 0; k < 3; ++k)
      out[i + k] = out[i + 3] > 0 ? std::min(1.0f, out[i + k] / out[i + 3]) : 0.0f;
  return out;
}

// The views of a split before they are read.
struct Plan {
  std::vector<Shot> shots;
  std::vector<fs::path> files;
  Index size = 0;               // of the images before they are cut, 0: as they are
  Index width = 0, height = 0;  // of the first image where there are lenses
  std::optional<Crop> part{};   // where there are lenses
};

[[noreturn]] void fail_size(const Plan& plan, const Shot& shot, Index w0, Index h0, Index w, Index h) {
  throw IoError(shot.place + ": expected an image of " + std::to_string(w0) + " x " + std::to_string(h0) +
                " pixels as " + plan.shots.front().label + ", got " + std::to_string(w) + " x " +
                std::to_string(h));
}

View read_view(const Plan& plan, std::size_t i) {
  const Shot& shot = plan.shots[i];
  const fs::path& path = plan.files[i];
  View view{.camera = {}, .rgba = {}, .name = path.stem().string(), .depth = shot.depth};
  view.rgba = to_rgba(at_place(shot.place, [&] { return read_image(path); }));
  const Index width = view.rgba.shape[1], height = view.rgba.shape[0];
  view.camera = at_place(shot.place, [&] { return shot.intrinsics.camera(shot.pose, width, height); });
  Camera scaled = view.camera.scaled(plan.size);
  if (plan.part) {
    if (width != plan.width || height != plan.height)
      fail_size(plan, shot, plan.width, plan.height, width, height);
    view.rgba = undistorted_image(view.rgba, view.camera, shot.intrinsics.lens, *plan.part);
    const auto shrunk = [&](Index side, Index from, Index to) {
      return std::max<Index>(1, (2 * side * to + from) / (2 * from));
    };
    const Camera part = cropped(view.camera, *plan.part);
    scaled = part.scaled(shrunk(part.width, width, scaled.width), shrunk(part.height, height, scaled.height));
    view.camera = part;
  }
  view.rgba = resize_rgba(std::move(view.rgba), scaled.height, scaled.width);
  return view;
}

// The part of an image that every lens of the capture covers.
void plan_lenses(const std::vector<Shot>& all, Plan& plan, std::vector<std::string>& notes) {
  if (std::all_of(all.begin(), all.end(), [](const Shot& s) { return s.intrinsics.lens.is_pinhole(); }))
    return;
  const Tensor<float> first =
      at_place(plan.shots.front().place, [&] { return read_image(plan.files.front()); });
  plan.width = first.shape[1], plan.height = first.shape[0];
  Index left = 0, top = 0, right = plan.width, bottom = plan.height;
  std::vector<std::pair<Camera, Lens>> seen;
  for (const Shot& shot : all) {
    const Lens& lens = shot.intrinsics.lens;
    const Crop part = at_place(shot.place, [&] {
      const Camera camera = shot.intrinsics.camera({}, plan.width, plan.height);
      const auto same = [&](const auto& s) {
        return s.first.parameters() == camera.parameters() && s.second == lens;
      };
      if (std::any_of(seen.begin(), seen.end(), same))
        return Crop{.left = left, .top = top, .width = right - left, .height = bottom - top};
      seen.emplace_back(camera, lens);
      return covered_part(camera, lens);
    });
    left = std::max(left, part.left), top = std::max(top, part.top);
    right = std::min(right, part.left + part.width), bottom = std::min(bottom, part.top + part.height);
  }
  if (left >= right || top >= bottom)
    throw IoError(all.front().place + ": expected lenses that have a part of the image in common, got none");
  plan.part = {.left = left, .top = top, .width = right - left, .height = bottom - top};
  notes.push_back("lens distortion removed: images of " + std::to_string(plan.width) + " x " +
                  std::to_string(plan.height) + " pixels are cut to the " + std::to_string(right - left) +
                  " x " + std::to_string(bottom - top) + " that all of them have");
}

// The shots of a split, with the files of their images.
Plan plan_split(const Capture& capture, const DatasetOptions& options, const fs::path& folder,
                std::vector<std::string>& notes) {
  Plan plan{.shots = {}, .files = {}, .size = options.size};
  constexpr std::size_t kHeldOut = 8;
  std::size_t missing = 0, wanted = 0;
  std::string first_missing;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    if (capture.all_splits && (options.split == "train") == (i % kHeldOut == 0)) continue;
    const Shot& shot = capture.shots[i];
    const fs::path file = image_file(shot);
    ++wanted;
    if (!file.empty()) {
      plan.shots.push_back(shot), plan.files.push_back(file);
    } else if (capture.may_miss) {
      if (missing++ == 0) first_missing = shot.image.string();
    } else {
      throw IoError(shot.place + ": expected an image, got no file " + shot.image.string() + ".png");
    }
  }
  if (plan.shots.empty())
    throw IoError(
        folder.string() + ": expected images to " + options.split + " on, got none" +
        (missing > 0
             ? ": all " + std::to_string(wanted) + " are missing, the first is " + first_missing
             : ": there are " + std::to_string(capture.shots.size()) + " views, and every 8th is held out"));
  if (capture.all_splits)
    notes.push_back("every 8th of " + std::to_string(capture.shots.size()) +
                    " images is held out for val and test");
  if (missing > 0)
    notes.push_back(std::to_string(missing) + " of " + std::to_string(wanted) + " images of " +
                    options.split + " are missing and left out, the first is " + first_missing);
  return plan;
}

bool has_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

Capture read_capture(const fs::path& folder, Layout layout, const DatasetOptions& options) {
  if (layout == Layout::blender) return read_blender(folder, options.split);
  if (layout == Layout::transforms) return read_transforms(folder);
  return layout == Layout::llff ? read_llff(folder, options.size) : read_colmap(folder, options.size);
}

// In parallel; the first image's error is the one reported, however many threads read.
std::vector<View> read_views(const Plan& plan) {
  const std::size_t count = plan.shots.size();
  std::vector<View> views(count);
  std::vector<std::exception_ptr> errors(count);
  parallel_for(static_cast<Index>(count), 1, [&](Index begin, Index) {
    const auto i = static_cast<std::size_t>(begin);
    try {
      views[i] = read_view(plan, i);
    } catch (...) {
      errors[i] = std::current_exception();
    }
  });
  for (std::size_t i = 0; i < count; ++i) {
    if (errors[i]) std::rethrow_exception(errors[i]);
    const Camera &first = views[0].camera, &c = views[i].camera;
    if (c.width != first.width || c.height != first.height)
      fail_size(plan, plan.shots[i], first.width, first.height, c.width, c.height);
  }
  for (View& v : views) v.camera = v.camera.scaled(v.rgba.shape[1], v.rgba.shape[0]);
  return views;
}
}  // namespace

float background_value(Background background) { return background == Background::white ? 1.0f : 0.0f; }

Layout find_layout(const fs::path& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw IoError(folder.string() + ": expected a data set folder, got " +
                  (fs::exists(folder, error) ? "something else"
                   : error                   ? error.message()
                                             : "nothing of that name"));
  for (const char* split : {"train", "val", "test"})
    if (has_file(folder / ("transforms_" + std::string(split) + ".json"))) return Layout::blender;
  if (has_file(folder / "transforms.json")) return Layout::transforms;
  if (has_file(folder / "poses_bounds.npy")) return Layout::llff;
  if (!colmap_folder(folder).empty()) return Layout::colmap;
  throw IoError(
      folder.string() +
      ": expected a data set: transforms_train.json (Blender), transforms.json (instant-ngp, "
      "nerfstudio), poses_bounds.npy (LLFF), or cameras.bin or cameras.txt (COLMAP) in it, in sparse "
      "or in sparse/0; got none of these files");
}

bool has_split(const fs::path& folder, std::string_view split) {
  return find_layout(folder) != Layout::blender ||
         has_file(folder / ("transforms_" + std::string(split) + ".json"));
}

Dataset load_dataset(const fs::path& folder, const DatasetOptions& options) {
  if (options.split != "train" && options.split != "val" && options.split != "test")
    throw ValueError("[load_dataset] split must be train, val or test, got \"" + options.split + "\"");
  if (options.size < 0 || options.size > 65536)
    throw ValueError("[load_dataset] size must be 0 to 65536 pixels, got " + std::to_string(options.size));
  const Layout layout = find_layout(folder);
  Capture capture = read_capture(folder, layout, options);
  Plan plan = plan_split(capture, options, folder, capture.notes);
  plan_lenses(capture.shots, plan, capture.notes);
  return {.name = fs::absolute(folder / "x").lexically_normal().parent_path().filename().string(),
          .split = options.split,
          .background =
              options.background.value_or(layout == Layout::blender ? Background::white : Background::black),
          .views = read_views(plan),
          .layout = layout,
          .forward_facing = capture.forward_facing,
          .notes = std::move(capture.notes)};
}

Tensor<float> composited(const View& view, Background background) {
  const Index pixels = view.rgba.shape[0] * view.rgba.shape[1];
  Tensor<float> out(Shape{view.rgba.shape[0], view.rgba.shape[1], 3});
  const float behind = background_value(background);
  for (Index i = 0; i < pixels; ++i) {
    const float* in = view.rgba.data.data() + 4 * i;
    for (Index k = 0; k < 3; ++k) out[3 * i + k] = in[k] * in[3] + behind * (1 - in[3]);
  }
  return out;
}

}  // namespace fieldmark::nerf
