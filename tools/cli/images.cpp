#include "cli/images.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <cctype>

namespace fieldmark::cli {
namespace {

bool is_digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

std::string digits_at(const std::string& s, std::size_t i) {
  std::size_t end = i;
  while (end < s.size() && is_digit(s[end])) ++end;
  return s.substr(i, end - i);
}

bool is_image(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

}  // namespace

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

std::vector<std::filesystem::path> list_images(const std::vector<std::string>& paths) {
  std::vector<std::filesystem::path> images;
  for (const std::filesystem::path path : paths) {
    if (!std::filesystem::exists(path)) throw IoError(path.string() + ": no such file or folder");
    if (!std::filesystem::is_directory(path)) {
      images.push_back(path);
      continue;
    }
    std::vector<std::filesystem::path> inside;
    for (const auto& entry : std::filesystem::directory_iterator(path))
      if (entry.is_regular_file() && is_image(entry.path())) inside.push_back(entry.path());
    if (inside.empty())
      throw IoError(path.string() + ": expected PNG or JPEG files in the folder, found none");
    std::sort(inside.begin(), inside.end(), [](const auto& a, const auto& b) {
      return natural_less(a.filename().string(), b.filename().string());
    });
    images.insert(images.end(), inside.begin(), inside.end());
  }
  return images;
}

Tensor<float> read_rgb(const std::filesystem::path& path, float background) {
  Tensor<float> image = read_image(path);
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

}  // namespace fieldmark::cli
