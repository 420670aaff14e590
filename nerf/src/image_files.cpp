#include "image_files.h"

#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <regex>
#include <string_view>

namespace fieldmark::nerf {
namespace {
namespace fs = std::filesystem;

// ASCII only: names that differ by case come from extensions and cameras.
std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::string upper_case(std::string_view text) {
  std::string upper(text);
  for (char& c : upper)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return upper;
}

// Returns true for the name of an image in a format that is not read, of which a readable copy may exist
// here.
bool is_foreign_name(const fs::path& file) {
  constexpr std::string_view kForeign[] = {".tif", ".tiff", ".bmp", ".tga", ".gif", ".jp2",
                                           ".exr", ".hdr",  ".dng", ".cr2", ".nef", ".arw"};
  const std::string extension = lower_case(file.extension().string());
  return std::ranges::find(kForeign, extension) != std::end(kForeign);
}

bool is_folder(const fs::path& path) {
  std::error_code ignored;
  return fs::is_directory(path, ignored);
}

// Returns the file of exactly this name, or with an extension appended.
fs::path spelled_so(const fs::path& named) {
  std::vector<std::string> endings{""};
  for (const std::string_view extension : image_extensions()) endings.emplace_back(extension);
  for (const std::string_view extension : image_extensions()) endings.push_back(upper_case(extension));
  for (const std::string& ending : endings) {
    fs::path file = named.string() + ending;
    std::error_code ignored;
    if (fs::is_regular_file(file, ignored)) return file;
  }
  return {};
}

// Returns the folder, or one whose name differs only by case; empty: none.
fs::path folder_alike(const fs::path& folder) {
  if (folder.empty()) return ".";
  if (is_folder(folder)) return folder;
  if (!folder.has_filename() || folder.parent_path() == folder) return {};
  const fs::path parent = folder_alike(folder.parent_path());
  if (parent.empty()) return {};
  const std::string wanted = lower_case(folder.filename().string());
  std::vector<fs::path> found;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(parent, ignored))
    if (lower_case(entry.path().filename().string()) == wanted && is_folder(entry.path()))
      found.push_back(entry.path());
  return found.empty() ? fs::path{} : *std::min_element(found.begin(), found.end());
}
}  // namespace

fs::path with_slashes(const fs::path& path) {
  std::string text = path.string();
  std::replace(text.begin(), text.end(), '\\', '/');
  return fs::path(text).lexically_normal();
}

std::vector<fs::path> images_in(const fs::path& folder) {
  std::vector<fs::path> found;
  if (!is_folder(folder)) return found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (has_image_extension(name) && !name.starts_with('.') && !name.starts_with("dynamic_mask_"))
      found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

fs::path image_folder(const fs::path& folder, Index size) {
  if (!is_folder(folder)) return {};
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
  if (best.empty() && !images_in(folder / "input").empty()) best = folder / "input";
  return best;
}

const ImageFinder::Listing& ImageFinder::listing(const fs::path& folder) {
  const auto [place, is_new] = listings_.try_emplace(folder);
  if (!is_new) return place->second;
  const fs::path real = folder_alike(folder);
  if (real.empty()) return place->second;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(real, ignored))
    if (has_image_extension(entry.path()) && entry.is_regular_file(ignored))
      place->second.emplace(lower_case(entry.path().stem().string()), entry.path());
  return place->second;
}

// Among similar files, one whose name differs only by case comes before one with the same stem, and names of
// equal rank are sorted, so the choice does not depend on the folder's order.
fs::path ImageFinder::alike(const fs::path& named) {
  const Listing& files = listing(named.parent_path());
  const std::string name = named.filename().string(), stem = named.stem().string();
  std::optional<std::pair<int, fs::path>> best;
  const auto consider = [&](const std::string& of_stem) {
    const auto [begin, end] = files.equal_range(lower_case(of_stem));
    for (auto file = begin; file != end; ++file) {
      const bool same_name = lower_case(file->second.filename().string()) == lower_case(name);
      const int rank = same_name ? 0 : file->second.stem().string() == of_stem ? 1 : 2;
      if (std::pair found{rank, file->second}; !best || found < *best) best = found;
    }
  };
  consider(name);
  if (has_image_extension(named) || is_foreign_name(named)) consider(stem);
  return best ? best->second : fs::path{};
}

fs::path ImageFinder::find_below(const fs::path& folder, const fs::path& named) {
  const fs::path path = with_slashes(named);
  const std::string text = path.string();
  const bool has_drive = text.size() > 2 && text[1] == ':' && text[2] == '/';
  if (!has_drive && !text.starts_with('/')) return {};
  for (auto first = std::next(path.begin()); first != path.end(); ++first) {
    fs::path end;
    for (auto part = first; part != path.end(); ++part) end /= *part;
    if (!find(folder / end).empty()) return (folder / end).lexically_normal();
  }
  return {};
}

fs::path ImageFinder::find(const fs::path& named) {
  if (fs::path file = spelled_so(named); !file.empty()) return file;
  const fs::path slashed = with_slashes(named);
  if (fs::path file = spelled_so(slashed); !file.empty()) return file;
  return alike(slashed);
}

}  // namespace fieldmark::nerf
