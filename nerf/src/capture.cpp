#include "capture.h"

#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <limits>
#include <regex>

#include "colmap.h"
#include "llff.h"
#include "rotation.h"
#include "transforms.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

// A file of the transforms layouts.
Capture read_json(const fs::path& folder, const fs::path& file) {
  const Transforms t = parse_transforms(read_text(file), file.string());
  Capture capture;
  for (const auto& frame : t.frames) {
    const std::string label = "frames[" + std::to_string(capture.shots.size()) + "]";
    capture.shots.push_back({.image = (folder / frame.file_path).lexically_normal(),
                             .label = label,
                             .place = file.string() + ": " + label + ".file_path",
                             .pose = frame.pose,
                             .intrinsics = frame.intrinsics});
  }
  return capture;
}

// The folder images or images_N that fits `size`, see load_dataset(); empty where there is none.
fs::path image_folder(const fs::path& folder, Index size) {
  static const std::regex name("images(_[0-9]{0,8}[1-9][0-9]{0,8})?");
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && std::regex_match(entry.path().filename().string(), name))
      folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  fs::path best;
  Index best_side = 0;
  const Index wanted = size > 0 ? size : std::numeric_limits<Index>::max();
  for (const auto& f : folders) {
    const auto images = images_in(f);
    if (images.empty()) continue;
    const Tensor<float> first = read_image(images.front());
    const Index side = std::max(first.shape[0], first.shape[1]);
    const bool better = best_side < wanted ? side > best_side : side >= wanted && side < best_side;
    if (better) best = f, best_side = side;
  }
  return best;
}

bool faces_forward(const std::vector<LlffView>& views) {
  Vec3 mean{};
  for (const auto& v : views) mean = mean + pose_column(v.pose, 2);
  return norm(mean) > 0 && std::all_of(views.begin(), views.end(), [&](const LlffView& v) {
           return dot(normalised(mean), pose_column(v.pose, 2)) > 0.5;
         });
}
}  // namespace

std::vector<fs::path> images_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code none;
  if (!fs::is_directory(folder, none)) return found;
  static const std::regex extension("\\.(png|jpe?g)", std::regex::icase);
  for (const auto& entry : fs::directory_iterator(folder))
    if (std::regex_match(entry.path().extension().string(), extension)) found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

fs::path image_file(const Shot& shot) {
  for (const char* extension : {"", ".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"}) {
    fs::path file = shot.image.string() + extension;
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored)) return file;
  }
  return {};
}

Capture read_blender(const fs::path& folder, const std::string& split) {
  return read_json(folder, folder / ("transforms_" + split + ".json"));
}

Capture read_transforms(const fs::path& folder) {
  Capture capture = read_json(folder, folder / "transforms.json");
  capture.all_splits = capture.may_miss = true;
  std::stable_sort(capture.shots.begin(), capture.shots.end(),
                   [](const Shot& a, const Shot& b) { return a.image.native() < b.image.native(); });
  return capture;
}

Capture read_llff(const fs::path& folder, Index size) {
  const fs::path file = folder / "poses_bounds.npy";
  std::vector<LlffView> views = parse_poses_bounds(read_text(file), file.string());
  at_place(file.string(), [&] { return recentre_llff(views); });
  const fs::path images = image_folder(folder, size);
  if (images.empty())
    throw IoError(folder.string() +
                  ": expected images (.png, .jpg, .jpeg) in a folder images or images_N, got none");
  const auto files = images_in(images);
  if (files.size() != views.size())
    throw IoError(images.string() + ": expected an image for each of the " + std::to_string(views.size()) +
                  " rows of " + file.string() + ", got " + std::to_string(files.size()));
  Capture capture{.all_splits = true,
                  .forward_facing = faces_forward(views),
                  .notes = {"images of " + images.filename().string()}};
  for (std::size_t i = 0; i < views.size(); ++i)
    capture.shots.push_back({.image = files[i],
                             .label = "the first",
                             .place = file.string() + ": row " + std::to_string(i),
                             .pose = views[i].pose,
                             .intrinsics = views[i].intrinsics,
                             .depth = views[i].depth});
  return capture;
}

fs::path colmap_folder(const fs::path& folder) {
  for (const fs::path& model : {folder / "sparse" / "0", folder / "sparse", folder})
    for (const char* file : {"cameras.bin", "cameras.txt"})
      if (std::error_code ignored; fs::is_regular_file(model / file, ignored)) return model;
  return {};
}

Capture read_colmap(const fs::path& folder, Index size) {
  const fs::path model = colmap_folder(folder);
  const bool binary = fs::exists(model / "cameras.bin");
  const ColmapFormat format = binary ? ColmapFormat::binary : ColmapFormat::text;
  const auto file = [&](const char* stem) {
    return (model / (std::string(stem) + (binary ? ".bin" : ".txt"))).string();
  };
  const std::string list = file("images"), cameras = file("cameras");
  const auto intrinsics = parse_colmap_cameras(read_text(cameras), format, cameras);
  auto views = parse_colmap_images(read_text(list), format, list);

  // `folder` may be that of the model, below the folder of the images.
  fs::path images;
  for (const fs::path& base : {folder, model / "..", model / ".." / ".."})
    if (images.empty()) images = image_folder(base, size);
  if (images.empty()) images = folder / "images";
  images = images.lexically_normal();
  Capture capture{.all_splits = true, .may_miss = true, .notes = {"images of " + images.filename().string()}};
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
                             .intrinsics = camera->second});
  }
  return capture;
}

}  // namespace fieldmark::nerf
