#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/data_survey.h>

#include <algorithm>
#include <cmath>

#include "data_files.h"
#include "odd_cameras.h"
#include "odd_images.h"
#include "silhouettes.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kCells = 32;  // of a thumbnail's side
// Largest RMS difference between versions of one image, such as JPEG of quality 50 or another size.
constexpr double kSameImage = 0.01;
// Cameras that show nearly the same, such as neighbouring video frames.
constexpr double kSameAngle = 0.02, kSamePlace = 0.02;

// Returns where part i of a side begins; each part has at least one pixel.
Index begin_of(Index i, Index side) { return i * side / kCells; }
Index end_of(Index i, Index side) { return std::max(begin_of(i + 1, side), begin_of(i, side) + 1); }

std::vector<float> thumbnail(const View& view, Index width, Index height) {
  std::vector<float> cells;
  cells.reserve(at(4 * kCells * kCells));
  const Index stride = view.rgba.shape[1];
  for (Index v = 0; v < kCells; ++v)
    for (Index u = 0; u < kCells; ++u) {
      const Index left = begin_of(u, width), right = end_of(u, width), top = begin_of(v, height),
                  bottom = end_of(v, height);
      std::array<float, 4> sum{};
      for (Index y = top; y < bottom; ++y)
        for (Index x = left; x < right; ++x) {
          const float* p = &view.rgba.data[at(4 * (y * stride + x))];
          for (std::size_t k = 0; k < 3; ++k) sum[k] += p[3] * p[k];
          sum[3] += p[3];
        }
      const auto pixels = static_cast<float>((right - left) * (bottom - top));
      for (const float s : sum) cells.push_back(s / pixels);
    }
  return cells;
}

double valid_share(const View& view, Index width, Index height) {
  if (view.valid.empty()) return 1;
  Index valid = 0;
  for (Index y = 0; y < height; ++y)
    for (Index x = 0; x < width; ++x) valid += is_valid(view, y * view.rgba.shape[1] + x);
  return static_cast<double>(valid) / static_cast<double>(width * height);
}

SurveyedView survey(const View& view, const std::string& split) {
  const Index width = view.own_width > 0 ? view.own_width : view.rgba.shape[1],
              height = view.own_height > 0 ? view.own_height : view.rgba.shape[0];
  Camera camera = view.camera;
  camera.width = width, camera.height = height;
  return {.name = view.name,
          .split = split,
          .camera = camera,
          .width = view.file_width > 0 ? view.file_width : width,
          .height = view.file_height > 0 ? view.file_height : height,
          .valid = valid_share(view, width, height),
          .thumbnail = thumbnail(view, width, height)};
}

double rms_difference(const SurveyedView& a, const SurveyedView& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.thumbnail.size(); ++i) {
    const double d = static_cast<double>(a.thumbnail[i]) - static_cast<double>(b.thumbnail[i]);
    sum += d * d;
  }
  return std::sqrt(sum / static_cast<double>(a.thumbnail.size()));
}

bool same_camera(const Camera& a, const Camera& b, double scale) {
  const double cosine = dot(normalised(a.forward()), normalised(b.forward()));
  return norm(a.position() - b.position()) <= kSamePlace * scale && cosine >= std::cos(kSameAngle);
}

}  // namespace

std::vector<SurveyedView> survey_views(const Dataset& data) {
  std::vector<SurveyedView> views(data.views.size());
  parallel_for(std::ssize(views), 1,
               [&](Index i, Index) { views[at(i)] = survey(data.views[at(i)], data.split); });
  return views;
}

std::vector<Oddity> odd_views(std::span<const SurveyedView> views, SceneType scene) {
  std::vector<Oddity> found = odd_images(views, scene);
  for (Oddity& o : odd_cameras(views, scene)) found.push_back(std::move(o));
  return found;
}

std::vector<Oddity> twins(std::span<const SurveyedView> train, std::span<const SurveyedView> held_out) {
  std::vector<double> from_middle = distances_from_middle(train);
  std::ranges::sort(from_middle);
  // Not the median, which is 0 if there are many duplicates.
  const double scale = from_middle.empty() ? 0 : from_middle[(from_middle.size() - 1) * 9 / 10];
  Oddity found{.kind = "twins",
               .remedy =
                   "hold out other images, or remove the training images that show the same: until then "
                   "PSNR on the held-out images flatters"};
  for (const SurveyedView& view : held_out) {
    const auto twin = std::ranges::find_if(train, [&](const SurveyedView& t) {
      return same_image(t, view) ||
             (same_camera(t.camera, view.camera, scale) && rms_difference(t, view) <= kSameImage);
    });
    if (twin == train.end()) continue;
    ++found.count;
    found.images.push_back(full_name(view)), found.partners.push_back(full_name(*twin));
  }
  if (found.count == 0) return {};
  found.text = std::to_string(found.count) + " of " + std::to_string(held_out.size()) +
               " held-out images the same as a training image, or nearly so, the first is " +
               found.images.front() + ", as " + found.partners.front();
  return {found};
}

std::vector<Oddity> odd_files(const std::filesystem::path& folder, Index size) {
  const DataFiles files = list_files(folder, size);
  std::vector<Oddity> found;
  Oddity missing{
      .kind = "cameras_without_image",
      .remedy = "add these images under the names that their cameras state, or remove the cameras"};
  for (const DataFiles::Split& split : files.splits)
    for (const std::string& name : split.missing)
      if (std::ranges::find(missing.images, name) == missing.images.end()) missing.images.push_back(name);
  missing.count = std::ssize(missing.images);
  missing.text = counted(missing.count, "camera") + " without an image, the first is that of ";
  if (missing.count > 0) missing.text += missing.images.front(), found.push_back(missing);
  Oddity unused{.kind = "images_without_camera",
                .count = std::ssize(files.unused),
                .text = counted(std::ssize(files.unused), "image") + " without a camera, the first is ",
                .remedy =
                    "they are not used: add their cameras (run COLMAP again with more matches), or move them "
                    "elsewhere"};
  for (const auto& file : files.unused) unused.images.push_back(file.string());
  if (unused.count > 0) unused.text += unused.images.front(), found.push_back(unused);
  return found;
}

}  // namespace fieldmark::nerf
