#include "colmap.h"

#include <fieldmark/core/files.h>

#include <algorithm>
#include <iterator>

#include "capture.h"
#include "image_files.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

bool is_model(const fs::path& folder) {
  std::error_code ignored;
  return fs::is_regular_file(folder / "cameras.bin", ignored) ||
         fs::is_regular_file(folder / "cameras.txt", ignored);
}

bool is_binary(const fs::path& model) { return fs::exists(model / "cameras.bin"); }

std::string file_of(const fs::path& model, const char* stem) {
  return (model / (std::string(stem) + (is_binary(model) ? ".bin" : ".txt"))).string();
}

std::vector<ColmapImage> images_of(const fs::path& model) {
  const std::string list = file_of(model, "images");
  return parse_colmap_images(read_text(list), is_binary(model) ? ColmapFormat::binary : ColmapFormat::text,
                             list);
}

// Returns the number of images of a model; 0 if they cannot be read, because another model next to it may be
// readable.
std::size_t count_images(const fs::path& model) {
  try {
    return images_of(model).size();
  } catch (const IoError&) {
    return 0;
  }
}

// Returns the models among the folders in `parent`; numbered ones come in order of their numbers.
std::vector<fs::path> models_in(const fs::path& parent) {
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(parent, ignored))
    if (is_model(entry.path())) found.push_back(entry.path());
  std::sort(found.begin(), found.end(), [](const fs::path& a, const fs::path& b) {
    const std::string x = a.filename().string(), y = b.filename().string();
    return std::pair(x.size(), x) < std::pair(y.size(), y);
  });
  return found;
}

// Returns all models in the first place below `folder` that has one.
std::vector<fs::path> models_below(const fs::path& folder) {
  const fs::path sparse = folder / "sparse";
  if (auto found = models_in(sparse); !found.empty()) return found;
  for (const fs::path& model : {sparse, folder})
    if (is_model(model)) return {model};
  return {};
}

std::vector<fs::path> models_side_by_side(const fs::path& folder) {
  for (const fs::path& place : {folder, folder / "colmap", folder / "dense"})
    if (auto found = models_below(place); !found.empty()) return found;
  // COLMAP writes the undistorted images of model N and their model to dense/N.
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder / "dense", ignored))
    for (fs::path& model : models_below(entry.path())) found.push_back(std::move(model));
  std::sort(found.begin(), found.end());
  return found.empty() ? models_in(folder) : found;
}

// Returns the folders that may contain the folder of images, nearest to the model first: next to
// dense/0/sparse are the undistorted images, and above it perhaps the originals. `folder` may also be the
// model's own.
std::vector<fs::path> places_of_images(const fs::path& folder, const fs::path& model) {
  std::vector<fs::path> places;
  const fs::path below = model.lexically_relative(folder);
  const bool itself = below == ".";
  if (itself) places.push_back(folder);
  fs::path up = model;
  const auto levels = itself ? 3 : std::distance(below.begin(), below.end());
  for (std::ptrdiff_t i = 0; i < levels; ++i) places.push_back(up /= "..");
  return places;
}

fs::path images_for(const fs::path& folder, const fs::path& model, Index size) {
  for (const fs::path& place : places_of_images(folder, model))
    if (const fs::path images = image_folder(place, size); !images.empty()) return images.lexically_normal();
  return (folder / "images").lexically_normal();
}
}  // namespace

fs::path colmap_folder(const fs::path& folder, std::vector<std::string>* choice) {
  const std::vector<fs::path> models = models_side_by_side(folder);
  if (models.size() < 2) return models.empty() ? fs::path{} : models.front();
  fs::path best = models.front();
  std::size_t most = 0;
  std::string counts;
  for (const fs::path& model : models) {
    const std::size_t count = count_images(model);
    if (count > most) most = count, best = model;
    counts += (counts.empty() ? "" : ", ") + model.lexically_relative(folder).string() + " has " +
              std::to_string(count);
  }
  if (choice)
    choice->push_back("COLMAP model " + best.lexically_relative(folder).string() +
                      " is taken, which has the most images of " + std::to_string(models.size()) + ": " +
                      counts);
  return best;
}

Capture read_colmap(const fs::path& folder, Index size) {
  Capture capture{.all_splits = true, .may_miss = true};
  const fs::path model = colmap_folder(folder, &capture.notes);
  const std::string list = file_of(model, "images"), cameras = file_of(model, "cameras");
  const auto intrinsics = parse_colmap_cameras(
      read_text(cameras), is_binary(model) ? ColmapFormat::binary : ColmapFormat::text, cameras);
  auto views = images_of(model);
  const fs::path images = images_for(folder, model, size);
  capture.notes.push_back("images of " + images.filename().string());
  std::sort(views.begin(), views.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  for (const ColmapImage& view : views) {
    const std::string place = list + ": " + view.name;
    const auto camera = intrinsics.find(view.camera);
    if (camera == intrinsics.end())
      throw IoError(place + ": expected a camera of " + cameras + ", got number " +
                    std::to_string(view.camera));
    capture.shots.push_back({.image = images / view.name,
                             .label = "the first",
                             .place = place,
                             .pose = view.pose,
                             .intrinsics = camera->second,
                             .as_stored = true});
  }
  return capture;
}

}  // namespace fieldmark::nerf
