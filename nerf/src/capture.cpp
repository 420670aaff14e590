#include "capture.h"

#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include "colmap.h"
#include "llff.h"
#include "transforms.h"

#include <algorithm>
#include <charconv>
#include <limits>

#include "vec3.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

std::vector<Shot> shots_of(const Transforms& transforms, const fs::path& folder, const std::string& json) {
  std::vector<Shot> shots;
  for (const auto& frame : transforms.frames) {
    const std::string label = "frames[" + std::to_string(shots.size()) + "]";
    shots.push_back({.image = (folder / frame.file_path).lexically_normal(),
                     .label = label,
                     .place = json + ": " + label + ".file_path",
                     .pose = frame.pose,
                     .intrinsics = frame.intrinsics});
  }
  return shots;
}

// "images" is 1, "images_8" is 8, other names 0.
int divisor_of(const std::string& name) {
  if (name == "images") return 1;
  if (!name.starts_with("images_")) return 0;
  int n = 0;
  const char* end = name.data() + name.size();
  const auto [stop, error] = std::from_chars(name.data() + 7, end, n);
  return error == std::errc() && stop == end && n > 0 ? n : 0;
}

// The folder of images that fits `size`, see load_dataset(); empty where there is none.
fs::path image_folder(const fs::path& folder, Index size) {
  fs::path best;
  Index best_side = 0;
  const Index wanted = size > 0 ? size : std::numeric_limits<Index>::max();
  std::vector<fs::path> folders;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_directory() && divisor_of(entry.path().filename().string()) > 0)
      folders.push_back(entry.path());
  std::sort(folders.begin(), folders.end());
  for (const auto& f : folders) {
    const auto pictures = images_in(f);
    if (pictures.empty()) continue;
    const Tensor<float> first = read_image(pictures.front());
    const Index side = std::max(first.shape[0], first.shape[1]);
    const bool better = best_side < wanted ? side > best_side : side >= wanted && side < best_side;
    if (better) best = f, best_side = side;
  }
  return best;
}

bool faces_forward(const std::vector<LlffView>& views) {
  Vec3 mean{};
  for (const auto& v : views) mean = mean + Vec3{v.pose[2], v.pose[6], v.pose[10]};
  if (!(norm(mean) > 0)) return false;
  return std::all_of(views.begin(), views.end(), [&](const LlffView& v) {
    return dot(normalised(mean), {v.pose[2], v.pose[6], v.pose[10]}) > 0.5;
  });
}
}  // namespace

std::vector<fs::path> images_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code none;
  if (!fs::is_directory(folder, none)) return found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::string extension = entry.path().extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    if (extension == ".png" || extension == ".jpg" || extension == ".jpeg") found.push_back(entry.path());
  }
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

Tensor<float> read_shot(const Shot& shot, const fs::path& file) {
  try {
    return read_image(file);
  } catch (const IoError& e) {
    throw IoError(shot.place + ": " + e.what());
  }
}

Capture read_blender(const fs::path& folder, const std::string& split) {
  const fs::path file = folder / ("transforms_" + split + ".json");
  const Transforms t = parse_transforms(read_text(file), file.string());
  return {.shots = shots_of(t, folder, file.string()), .aabb_scale = t.aabb_scale};
}

Capture read_transforms(const fs::path& folder) {
  const fs::path file = folder / "transforms.json";
  const Transforms t = parse_transforms(read_text(file), file.string());
  Capture capture{.shots = shots_of(t, folder, file.string()),
                  .all_splits = true,
                  .may_miss = true,
                  .aabb_scale = t.aabb_scale};
  std::stable_sort(capture.shots.begin(), capture.shots.end(),
                   [](const Shot& a, const Shot& b) { return a.image.native() < b.image.native(); });
  return capture;
}

Capture read_llff(const fs::path& folder, Index size) {
  const fs::path file = folder / "poses_bounds.npy";
  std::vector<LlffView> views = parse_poses_bounds(read_text(file), file.string());
  try {
    recentre_llff(views);
  } catch (const ValueError& e) {
    throw IoError(file.string() + ": " + e.what());
  }
  const fs::path pictures = image_folder(folder, size);
  if (pictures.empty())
    throw IoError(folder.string() +
                  ": expected images (.png, .jpg, .jpeg) in a folder images or images_N, got none");
  const auto files = images_in(pictures);
  if (files.size() != views.size())
    throw IoError(pictures.string() + ": expected an image for each of the " + std::to_string(views.size()) +
                  " rows of " + file.string() + ", got " + std::to_string(files.size()));
  Capture capture{.all_splits = true, .forward_facing = faces_forward(views)};
  capture.notes.push_back("images of " + pictures.filename().string());
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
    return model / (std::string(stem) + (binary ? ".bin" : ".txt"));
  };
  const fs::path images = file("images"), cameras = file("cameras"), points = file("points3D");
  const auto lenses = parse_colmap_cameras(read_text(cameras), format, cameras.string());
  auto views = parse_colmap_images(read_text(images), format, images.string());
  std::map<std::uint64_t, Vec3> seen;
  if (fs::exists(points)) seen = parse_colmap_points(read_text(points), format, points.string());

  // A model may lie below its images' folder, where that folder itself was not given.
  fs::path pictures;
  for (const fs::path& base : {folder, model / "..", model / ".." / ".."})
    if (pictures.empty()) pictures = image_folder(base, size);
  if (pictures.empty()) pictures = folder / "images";
  pictures = pictures.lexically_normal();
  Capture capture{
      .all_splits = true, .may_miss = true, .notes = {"images of " + pictures.filename().string()}};
  std::sort(views.begin(), views.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  for (const ColmapImage& view : views) {
    const std::string place = images.string() + ": " + view.name;
    const auto lens = lenses.find(view.camera);
    if (lens == lenses.end())
      throw IoError(place + ": expected a camera of " + cameras.string() + ", got number " +
                    std::to_string(view.camera));
    capture.shots.push_back({.image = pictures / view.name,
                             .label = "the first",
                             .place = place,
                             .pose = view.pose,
                             .intrinsics = lens->second});
    try {
      if (!seen.empty()) capture.shots.back().depth = colmap_depth(view, seen);
    } catch (const ValueError& e) {
      throw IoError(place + ": " + e.what());
    }
  }
  for (const auto& [key, point] : seen) capture.points.push_back(point);
  return capture;
}

}  // namespace fieldmark::nerf
