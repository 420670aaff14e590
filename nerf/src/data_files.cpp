#include "data_files.h"

#include <algorithm>
#include <set>

#include "capture.h"
#include "image_files.h"

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

// Returns true if a file belongs to a used image, as r_0_depth.png to r_0.png.
bool is_companion(const fs::path& file, const std::set<std::string>& stems) {
  const std::string stem = file.stem().string();
  for (std::size_t end = 1; end < stem.size(); ++end)
    if ((stem[end] == '_' || stem[end] == '.') && stems.contains(stem.substr(0, end))) return true;
  return false;
}

// Returns the images in the folders of the used ones that are not themselves used.
std::vector<fs::path> unused_beside(const std::set<fs::path>& used, const std::set<fs::path>& masks) {
  std::set<fs::path> folders;
  std::set<std::string> stems;
  for (const fs::path& file : used) folders.insert(file.parent_path()), stems.insert(file.stem().string());
  std::vector<fs::path> unused;
  for (const fs::path& folder : folders)
    for (const fs::path& file : images_in(folder))
      if (!used.contains(file) && !masks.contains(file) && !is_companion(file, stems)) unused.push_back(file);
  return unused;
}

}  // namespace

DataFiles list_files(const fs::path& folder, Index size) {
  const Layout layout = find_layout(folder);
  DataFiles files;
  ImageFinder finder;
  std::set<fs::path> used, masks;
  std::optional<Capture> capture;
  for (std::size_t s = 0; s < kSplitNames.size(); ++s) {
    const std::string split(kSplitNames[s]);
    if (layout == Layout::blender) {
      std::error_code ignored;
      if (!fs::is_regular_file(folder / ("transforms_" + split + ".json"), ignored)) continue;
      capture.reset();
    }
    if (!capture) capture = read_capture(folder, layout, split, size);
    DataFiles::Split found{.split = split};
    for (std::size_t i = 0; i < capture->shots.size(); ++i) {
      if (!belongs(*capture, i, s)) continue;
      const Shot& shot = capture->shots[i];
      const fs::path file = finder.find(shot.image);
      if (file.empty()) {
        found.missing.push_back(shot.image.string());
        continue;
      }
      found.files.push_back(file);
      used.insert(file.lexically_normal());
      if (!shot.mask.empty()) masks.insert(finder.find(shot.mask).lexically_normal());
    }
    files.splits.push_back(std::move(found));
  }
  files.unused = unused_beside(used, masks);
  return files;
}

}  // namespace fieldmark::nerf
