#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/refined_cameras.h>
#include <fieldmark/tools/bench/data_forms.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "distorting_lens.h"

namespace fieldmark::bench {
namespace {

using Json = nlohmann::ordered_json;
using Path = std::filesystem::path;

constexpr Index kBorder = 4;                          // pixels
constexpr double kObstacle = 0.12;                    // radius, in widths
constexpr double kObstacleX = 0.5, kObstacleY = 0.6;  // centre, in widths and heights
constexpr double kMargin = 0.1;                       // of each side, which does not count behind a lens

// The images of a form and where its files say that they are.
struct Images {
  std::vector<nerf::View> views;
  std::string folder;  // below that of the form
};

bool covers_obstacle(Index x, Index y, Index width, Index height) {
  const auto w = static_cast<double>(width), h = static_cast<double>(height);
  return std::hypot(static_cast<double>(x) - kObstacleX * w, static_cast<double>(y) - kObstacleY * h) <
         kObstacle * w;
}
bool is_border(Index x, Index y, Index width, Index height) {
  return std::min({x, y, width - 1 - x, height - 1 - y}) < kBorder;
}

// Calls change(x, y, RGBA) for every pixel of every image.
template <class F>
void for_pixels(std::vector<nerf::View>& views, F change) {
  for (nerf::View& view : views) {
    const Index height = view.rgba.shape[0], width = view.rgba.shape[1];
    for (Index y = 0; y < height; ++y)
      for (Index x = 0; x < width; ++x) change(x, y, &view.rgba.data[at(4 * (y * width + x))]);
  }
}

// Writes an image as RGB if it is opaque, else as RGBA.
void write_view(const Path& file, const Tensor<float>& rgba) {
  const Index pixels = rgba.size() / 4;
  for (Index p = 0; p < pixels; ++p)
    if (rgba[4 * p + 3] < 1) return write_png(file, rgba);
  Tensor<float> rgb(Shape{rgba.shape[0], rgba.shape[1], 3});
  for (Index p = 0; p < pixels; ++p) std::copy_n(&rgba.data[at(4 * p)], 3, &rgb.data[at(3 * p)]);
  write_png(file, rgb);
}

// Writes the images and returns the frames of a transforms.json.
Json written(const Path& folder, const Images& images, const nerf::Vec3& moved = {}) {
  std::filesystem::create_directories(folder / images.folder);
  std::vector<nerf::View> named;
  std::vector<nerf::Camera> cameras;
  for (const nerf::View& view : images.views) {
    const std::string file = images.folder + "/" + view.name + ".png";
    write_view(folder / file, view.rgba);
    named.push_back({.camera = view.camera, .rgba = {}, .name = file});
    cameras.push_back(view.camera);
    for (std::size_t k = 0; k < 3; ++k) cameras.back().pose[4 * k + 3] += moved[k];
  }
  return Json::parse(nerf::format_transforms(named, cameras));
}

void write_json(const Path& file, const Json& json) { write_file_atomically(file, json.dump(1) + "\n"); }

// One transforms.json with the keys of `more` besides its frames, and those of `each` in every frame.
void write_one_file(const Path& folder, const Images& images, const Json& more = Json::object(),
                    const Json& each = Json::object()) {
  Json json = written(folder, images);
  json.update(more);
  Json& names = json["train_filenames"] = Json::array();
  for (Json& frame : json["frames"]) {
    frame.update(each);
    names.push_back(frame["file_path"]);
  }
  write_json(folder / "transforms.json", json);
}

void write_masked(const Path& folder, Images images) {
  const nerf::Camera c = images.views.front().camera;
  for_pixels(images.views, [&](Index x, Index y, float* rgba) {
    if (covers_obstacle(x, y, c.width, c.height)) rgba[0] = 1, rgba[1] = 0, rgba[2] = 1;
  });
  Tensor<float> mask(Shape{c.height, c.width, 1}, 1.f);
  for (Index y = 0; y < c.height; ++y)
    for (Index x = 0; x < c.width; ++x)
      if (covers_obstacle(x, y, c.width, c.height)) mask[y * c.width + x] = 0;
  write_png(folder / "mask.png", mask);
  write_one_file(folder, images, Json::object(), {{"mask_path", "mask.png"}});
}

// Returns a test view; the pixels that counts(x, y, opacity) accepts count.
template <class F>
JudgedView judged(const nerf::View& view, F counts) {
  const Index height = view.rgba.shape[0], width = view.rgba.shape[1];
  JudgedView j{view.camera, nerf::composited(view, nerf::Background::white), Tensor<float>({height, width})};
  for (Index y = 0; y < height; ++y)
    for (Index x = 0; x < width; ++x)
      j.counted[y * width + x] = counts(x, y, view.rgba[4 * (y * width + x) + 3]) ? 1.f : 0.f;
  return j;
}

nerf::Camera central(nerf::Camera c) {
  const double left = std::round(kMargin * static_cast<double>(c.width)),
               top = std::round(kMargin * static_cast<double>(c.height));
  c.cx -= left, c.cy -= top;
  c.width -= 2 * static_cast<Index>(left), c.height -= 2 * static_cast<Index>(top);
  return c;
}

Images through_lens(const nerf::SceneOptions& options, const std::vector<nerf::View>& views,
                    const DistortingLens& lens) {
  Images images{{}, "train"};
  for (const nerf::View& view : views)
    images.views.push_back(
        {.camera = view.camera, .rgba = distorted_image(options, view.camera, lens), .name = view.name});
  return images;
}

}  // namespace

DataGroup object_forms(const nerf::Dataset& train, const nerf::Dataset& test) {
  const Images images{train.views, "train"};
  const auto blender = [](const Images& of, const nerf::Vec3& moved) {
    return
        [=](const Path& folder) { write_json(folder / "transforms_train.json", written(folder, of, moved)); };
  };
  Images opaque = images;
  for_pixels(opaque.views, [](Index, Index, float* rgba) {
    for (int k = 0; k < 3; ++k) rgba[k] = rgba[k] * rgba[3] + 1 - rgba[3];
    rgba[3] = 1;
  });
  const nerf::Vec3 far{3e5, -4e5, 0}, farther{6e6, 0, 8e6};
  DataGroup group{.scene = train.name,
                  .forms = {{"with alpha", 0, {}, blender(images, {})},
                            {"opaque before white", 1.0, {}, blender(opaque, {})},
                            {"moved by 500 km", 0.1, far, blender(images, far)},
                            {"moved by 1e7 units", 0.1, farther, blender(images, farther)}},
                  .test = {}};
  for (const nerf::View& view : test.views)
    group.test.push_back(judged(view, [](Index, Index, float opacity) { return opacity > 0.5f; }));
  return group;
}

DataGroup place_forms(const nerf::Dataset& train, const nerf::Dataset& test) {
  const Images images{train.views, "images"};
  const auto one_file = [](const Images& of) {
    return [=](const Path& folder) { write_one_file(folder, of); };
  };
  Images pixel = images, border = images;
  const Index height = images.views[0].rgba.shape[0], width = images.views[0].rgba.shape[1];
  pixel.views[0].rgba.data[at(4 * (height / 2 * width + width / 2) + 3)] = 0.5f;
  for_pixels(border.views, [=](Index x, Index y, float* rgba) {
    if (is_border(x, y, width, height)) rgba[3] = 0;
  });
  DataGroup group{
      .scene = train.name,
      .forms =
          {{"one transforms.json", 0, {}, one_file(images)},
           {"transforms_train.json and transforms_test.json",
            0.3,
            {},
            [=](const Path& folder) {
              write_json(folder / "transforms_train.json", written(folder, images));
              write_json(folder / "transforms_test.json", written(folder, {test.views, "test"}));
            }},
           {"a pixel that is not opaque", 0.3, {}, one_file(pixel)},
           {"a transparent border", 0.3, {}, one_file(border)},
           {"an obstacle behind masks", 0.3, {}, [=](const Path& folder) { write_masked(folder, images); }}},
      .test = {}};
  for (const nerf::View& view : test.views)
    group.test.push_back(judged(view, [&](Index x, Index y, float) {
      return !is_border(x, y, width, height) && !covers_obstacle(x, y, width, height);
    }));
  return group;
}

DataGroup lens_forms(const nerf::SceneOptions& options) {
  const auto views = nerf::make_scene(options, "train").views;
  const auto through = [=](const DistortingLens& lens) {
    return [=](const Path& folder) {
      write_one_file(folder, through_lens(options, views, lens), Json::parse(lens.keys()));
    };
  };
  DataGroup group{.scene = nerf::scene_kind_name(options.kind),
                  .forms = {{"pinhole",
                             0,
                             {},
                             [=](const Path& folder) {
                               write_one_file(folder, {views, "train"});
                             }},
                            {"equidistant fisheye", 0.5, {}, through(DistortingLens::equidistant())},
                            {"lens with k1 to k6", 0.5, {}, through(DistortingLens::rational())}},
                  .test = {}};
  for (const nerf::View& view : nerf::make_scene(options, "test").views) {
    nerf::View part{.camera = central(view.camera), .rgba = {}, .name = view.name};
    part.rgba = nerf::render_scene(options, part.camera);
    group.test.push_back(judged(part, [](Index, Index, float) { return true; }));
  }
  return group;
}

}  // namespace fieldmark::bench
