#include "capture.h"

#include <fieldmark/core/files.h>

#include <algorithm>
#include <map>

#include "image_files.h"
#include "llff.h"
#include "rotation.h"
#include "transforms.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

// Fills in Shot::in_split from the file's lists of names. A missing list is the rest: val and test stand in
// for one another, and train has what neither of them has.
void apply_lists(const Transforms& t, const std::string& file, Capture& capture) {
  std::map<fs::path, std::size_t> numbers;
  for (std::size_t i = 0; i < t.frames.size(); ++i) numbers.emplace(with_slashes(t.frames[i].file_path), i);
  std::array<std::size_t, 3> sizes{};
  for (std::size_t s = 0; s < kSplitNames.size(); ++s) {
    const std::string list = std::string(kSplitNames[s]) + "_filenames";
    std::size_t unknown = 0;
    std::string first_unknown;
    for (const std::string& name : t.splits[s]) {
      const auto number = numbers.find(with_slashes(name));
      if (number != numbers.end())
        capture.shots[number->second].in_split[s] = true;
      else if (unknown++ == 0)
        first_unknown = name;
    }
    if (unknown > 0 && unknown == t.splits[s].size())
      throw IoError(file + ": " + list + ": expected names that frames have as their file_path, got none, " +
                    "the first is \"" + first_unknown + "\"");
    if (unknown > 0)
      capture.notes.push_back(std::to_string(unknown) + " names of " + list +
                              " are those of no frame and left out, the first is " + first_unknown);
  }
  std::size_t shared = 0;
  for (Shot& shot : capture.shots) {
    auto& [train, val, test] = shot.in_split;
    const bool none_held_out = t.splits[1].empty() && t.splits[2].empty();
    if (none_held_out) val = test = !train;
    if (t.splits[1].empty()) val = test;
    if (t.splits[2].empty()) test = val;
    if (t.splits[0].empty()) train = !val && !test;
    shared += train && (val || test);
    for (std::size_t s = 0; s < 3; ++s) sizes[s] += shot.in_split[s];
  }
  capture.listed = true;
  capture.notes.push_back("the file's own split: " + std::to_string(sizes[0]) + " images to train, " +
                          std::to_string(sizes[1]) + " to val, " + std::to_string(sizes[2]) + " to test");
  if (shared > 0)
    capture.notes.push_back(std::to_string(shared) +
                            " images are both trained on and held out, so their PSNR flatters");
}

// Reads a file of the transforms layouts.
// @param all_splits  true if the file holds all splits, by its own lists or by image number
Capture read_json(const fs::path& folder, const fs::path& file, bool all_splits) {
  const Transforms t = parse_transforms(read_text(file), file.string());
  Capture capture{.notes = t.notes};
  ImageFinder finder;
  std::size_t moved = 0;
  const auto path_of = [&](const std::string& named) {
    const fs::path path = (folder / named).lexically_normal();
    if (!finder.find(path).empty()) return path;
    const fs::path here = finder.find_below(folder, named);
    moved += !here.empty();
    return here.empty() ? path : here;
  };
  for (const auto& frame : t.frames) {
    const std::string label = "frames[" + std::to_string(capture.shots.size()) + "]";
    capture.shots.push_back({.image = path_of(frame.file_path),
                             .label = label,
                             .place = file.string() + ": " + label + ".file_path",
                             .pose = frame.pose,
                             .intrinsics = frame.intrinsics});
    if (!frame.mask_path.empty()) capture.shots.back().mask = path_of(frame.mask_path);
  }
  if (moved > 0)
    capture.notes.push_back(std::to_string(moved) +
                            " files are named by a path that is not there, and found by its end in " +
                            folder.string());
  capture.all_splits = all_splits;
  if (all_splits && std::any_of(t.splits.begin(), t.splits.end(), [](const auto& l) { return !l.empty(); }))
    apply_lists(t, file.string(), capture);
  return capture;
}

bool faces_forward(const std::vector<LlffView>& views) {
  Vec3 mean{};
  for (const auto& v : views) mean = mean + pose_column(v.pose, 2);
  return norm(mean) > 0 && std::all_of(views.begin(), views.end(), [&](const LlffView& v) {
           return dot(normalised(mean), pose_column(v.pose, 2)) > 0.5;
         });
}
}  // namespace

std::size_t split_number(std::string_view split) {
  const auto found = std::find(kSplitNames.begin(), kSplitNames.end(), split);
  if (found == kSplitNames.end())
    throw ValueError("[load_dataset] split must be train, val or test, got \"" + std::string(split) + "\"");
  return static_cast<std::size_t>(found - kSplitNames.begin());
}

bool belongs(const Capture& capture, std::size_t i, std::size_t split) {
  constexpr std::size_t kHeldOut = 8;
  if (capture.listed) return capture.shots[i].in_split[split];
  return !capture.all_splits || (split == 0) == (i % kHeldOut != 0);
}

Capture read_capture(const fs::path& folder, Layout layout, const std::string& split, Index size) {
  if (layout == Layout::blender) return read_blender(folder, split);
  if (layout == Layout::transforms) return read_transforms(folder);
  return layout == Layout::llff ? read_llff(folder, size) : read_colmap(folder, size);
}

Capture read_blender(const fs::path& folder, const std::string& split) {
  return read_json(folder, folder / ("transforms_" + split + ".json"), false);
}

Capture read_transforms(const fs::path& folder) {
  Capture capture = read_json(folder, folder / "transforms.json", true);
  capture.may_miss = true;
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
                             .depth = views[i].depth,
                             .as_stored = true});
  return capture;
}

}  // namespace fieldmark::nerf
