#include "cli/images.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/exif.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "cli/context.h"
#include "cli/counted.h"

namespace fieldmark::cli {
namespace {

namespace fs = std::filesystem;

std::string digits_at(const std::string& s, std::size_t i) {
  std::size_t end = i;
  while (end < s.size() && is_digit(s[end])) ++end;
  return s.substr(i, end - i);
}

struct Listing {
  std::vector<fs::path> images;
  std::map<std::string, std::size_t> others;  // numbers of skipped files, by kind
};

bool has_video_extension(const fs::path& path) {
  constexpr std::array<std::string_view, 6> kExtensions{".mp4", ".m4v", ".mov", ".webm", ".mkv", ".3gp"};
  return std::ranges::find(kExtensions, extension_of(path)) != kExtensions.end();
}

Listing list_folder(const fs::path& folder, Videos videos) {
  Listing found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    const std::string extension = extension_of(entry.path());
    if (entry.path().filename().string().starts_with('.'))
      ++found.others["hidden"];
    else if (has_image_extension(entry.path()) ||
             (videos == Videos::read && has_video_extension(entry.path())))
      found.images.push_back(entry.path());
    else
      ++found.others[extension.empty() ? "without extension" : extension];
  }
  std::ranges::sort(found.images, [](const auto& a, const auto& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return found;
}

// Returns "skipped 3 files that are hidden or not images: 1 hidden, 2 .txt", or an empty text.
std::string skipped(const Listing& listing) {
  std::size_t count = 0;
  std::string kinds;
  for (const auto& [kind, files] : listing.others) {
    count += files;
    kinds += (kinds.empty() ? "" : ", ") + std::to_string(files) + " " + kind;
  }
  return count == 0
             ? ""
             : "skipped " + counted(static_cast<std::int64_t>(count), "file") +
                   (count == 1 ? " that is hidden or not an image: " : " that are hidden or not images: ") +
                   kinds;
}

}  // namespace

std::string extension_of(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

bool natural_less(const std::string& a, const std::string& b) {
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[j])) {
      if (a[i] != b[j]) return a[i] < b[j];
      ++i, ++j;
      continue;
    }
    const std::string x = digits_at(a, i), y = digits_at(b, j);
    const auto value = [](const std::string& s) {
      return s.substr(std::min(s.find_first_not_of('0'), s.size()));
    };
    const std::string u = value(x), v = value(y);
    if (u.size() != v.size()) return u.size() < v.size();
    if (u != v) return u < v;
    i += x.size();
    j += y.size();
  }
  return a.size() - i < b.size() - j;
}

std::vector<fs::path> images_in(const fs::path& folder) {
  return list_folder(folder, Videos::refused).images;
}

std::vector<fs::path> list_images(const std::vector<std::string>& paths, Context& context, Videos videos) {
  std::vector<fs::path> images;
  for (const fs::path path : paths) {
    if (!fs::exists(path)) throw IoError(path.string() + ": no such file or folder");
    if (!fs::is_directory(path)) {
      images.push_back(path);
      continue;
    }
    const Listing inside = list_folder(path, videos);
    const std::string others = skipped(inside);
    if (inside.images.empty())
      throw IoError(path.string() + ": expected PNG, JPEG, WebP, AVIF or HEIC files" +
                    (videos == Videos::read ? ", or MP4, MOV or WebM," : "") + " in the folder, found none" +
                    (others.empty() ? "" : "; " + others));
    if (!others.empty()) context.note(path.string() + ": " + others);
    images.insert(images.end(), inside.images.begin(), inside.images.end());
  }
  return images;
}

Tensor<float> decode_upright(std::span<const std::byte> bytes, const std::string& name) {
  Tensor<float> image = decode_image(bytes, name);
  const int orientation = exif_orientation(bytes);
  return orientation == 1 ? image : turned(image, orientation);
}

Tensor<float> read_rgb(const fs::path& path, float background) {
  return decode_rgb(read_bytes(path), path.string(), background);
}

Tensor<float> decode_rgb(std::span<const std::byte> bytes, const std::string& name, float background) {
  Tensor<float> image = decode_upright(bytes, name);
  const Index channels = image.shape[2], pixels = image.shape[0] * image.shape[1];
  if (channels == 3) return image;
  const bool has_alpha = channels % 2 == 0;
  Tensor<float> rgb({image.shape[0], image.shape[1], 3});
  for (Index i = 0; i < pixels; ++i) {
    const float alpha = has_alpha ? image[i * channels + channels - 1] : 1;
    for (Index c = 0; c < 3; ++c)
      rgb[i * 3 + c] = alpha * image[i * channels + (channels < 3 ? 0 : c)] + (1 - alpha) * background;
  }
  return quantize8(rgb);
}

void ReadFaults::check(const fs::path& image, std::span<const std::byte> bytes) {
  if (const std::string odd = image_oddity(bytes); !odd.empty())
    warnings.push_back(image.string() + ": " + odd);
}

void ReadFaults::tell(bool any_read, Context& context) const {
  if (!any_read && !unreadable.empty()) throw IoError(unreadable.front().second);
  for (const auto& warning : warnings) context.note(warning);
  for (const auto& [image, reason] : unreadable) context.leave_out(image, reason);
}

}  // namespace fieldmark::cli
