#include <fieldmark/core/error.h>
#include <fieldmark/nerf/dataset.h>

#include <algorithm>

#include "capture.h"
#include "image_files.h"
#include "scene_look.h"
#include "view_files.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

bool has_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

std::optional<Layout> layout_of(const fs::path& folder) {
  for (const std::string_view split : kSplitNames)
    if (has_file(folder / ("transforms_" + std::string(split) + ".json"))) return Layout::blender;
  if (has_file(folder / "transforms.json")) return Layout::transforms;
  if (has_file(folder / "poses_bounds.npy")) return Layout::llff;
  if (!colmap_folder(folder).empty()) return Layout::colmap;
  return std::nullopt;
}

// Returns the file of a shot's mask; empty: none.
fs::path mask_file(const Shot& shot, const fs::path& image, ImageFinder& finder) {
  if (shot.mask.empty()) {
    const fs::path beside = image.parent_path() / ("dynamic_mask_" + image.stem().string() + ".png");
    return has_file(beside) ? beside : fs::path{};
  }
  const fs::path mask = finder.find(shot.mask);
  if (mask.empty())
    throw IoError(shot.place + ": expected the mask of its mask_path, got no file " + shot.mask.string());
  return mask;
}

[[noreturn]] void fail_without_images(const Capture& capture, const std::string& split,
                                      const fs::path& folder, std::size_t missing,
                                      const std::string& first_missing) {
  std::string why = "there are " + std::to_string(capture.shots.size()) + " views, and every 8th is held out";
  if (capture.listed) why = "the file's own split has none";
  if (missing > 0) why = "all " + std::to_string(missing) + " are missing, the first is " + first_missing;
  throw IoError(folder.string() + ": expected images to " + split + " on, got none: " + why);
}

// Returns the shots of a split with their image files.
ViewPlan plan_split(const Capture& capture, const DatasetOptions& options, const fs::path& folder,
                    std::vector<std::string>& notes) {
  ViewPlan plan{.size = options.size};
  ImageFinder finder;
  std::size_t missing = 0, wanted = 0;
  std::string first_missing;
  for (std::size_t i = 0; i < capture.shots.size(); ++i) {
    if (!belongs(capture, i, split_number(options.split))) continue;
    const Shot& shot = capture.shots[i];
    const fs::path file = finder.find(shot.image);
    ++wanted;
    if (!file.empty()) {
      plan.shots.push_back(shot), plan.files.push_back(file);
      plan.masks.push_back(mask_file(shot, file, finder));
    } else if (capture.may_miss) {
      if (missing++ == 0) first_missing = shot.image.string();
    } else {
      throw IoError(shot.place + ": expected an image, got no file " + shot.image.string() + ".png");
    }
  }
  if (plan.shots.empty()) fail_without_images(capture, options.split, folder, missing, first_missing);
  if (const auto most = static_cast<std::size_t>(options.most_views); most > 0 && most < plan.shots.size()) {
    for (std::size_t i = 0; i < most; ++i) {
      const std::size_t from = i * plan.shots.size() / most;
      plan.shots[i] = plan.shots[from], plan.files[i] = plan.files[from], plan.masks[i] = plan.masks[from];
    }
    plan.shots.resize(most), plan.files.resize(most), plan.masks.resize(most);
  }
  if (capture.all_splits && !capture.listed)
    notes.push_back("every 8th of " + std::to_string(capture.shots.size()) +
                    " images is held out for val and test");
  if (missing > 0)
    notes.push_back(std::to_string(missing) + " of " + std::to_string(wanted) + " images of " +
                    options.split + " are missing and left out, the first is " + first_missing);
  return plan;
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
  if (const auto layout = layout_of(folder)) return *layout;
  std::string below;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (const std::string name = entry.path().string();
        entry.is_directory(error) && layout_of(entry.path()) && (below.empty() || name < below))
      below = name;
  throw IoError(folder.string() +
                ": expected a data set: transforms_train.json (Blender), transforms.json (instant-ngp, "
                "nerfstudio), poses_bounds.npy (LLFF), or cameras.bin or cameras.txt (COLMAP) in it, or in "
                "sparse, colmap or dense below it; got none of these files" +
                (below.empty() ? "" : "; " + below + " is a data set"));
}

bool has_split(const fs::path& folder, std::string_view split) {
  const std::size_t number = split_number(split);
  const Layout layout = find_layout(folder);
  if (layout == Layout::llff || layout == Layout::colmap) return true;
  if (layout == Layout::blender && !has_file(folder / ("transforms_" + std::string(split) + ".json")))
    return false;
  const Capture capture = read_capture(folder, layout, std::string(split), 0);
  ImageFinder finder;
  for (std::size_t i = 0; i < capture.shots.size(); ++i)
    if (belongs(capture, i, number) && !finder.find(capture.shots[i].image).empty()) return true;
  return false;
}

Dataset load_dataset(const fs::path& folder, const DatasetOptions& options) {
  split_number(options.split);  // checks
  if (options.size < 0 || options.size > 65536)
    throw ValueError("[load_dataset] size must be 0 to 65536 pixels, got " + std::to_string(options.size));
  const Layout layout = find_layout(folder);
  Capture capture = read_capture(folder, layout, options.split, options.size);
  ViewPlan plan = plan_split(capture, options, folder, capture.notes);
  plan.resampled = options.resampled;
  plan_lenses(capture.shots, plan, capture.notes);
  std::vector<View> views = read_views(plan, capture.notes);
  Dataset data{.name = fs::absolute(folder / "x").lexically_normal().parent_path().filename().string(),
               .split = options.split,
               .views = std::move(views),
               .layout = layout,
               .notes = std::move(capture.notes)};
  settle_scene(data, options, capture.forward_facing);
  return data;
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
