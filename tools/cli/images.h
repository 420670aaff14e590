#pragma once
#include <fieldmark/core/error.h>
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace fieldmark::cli {

class Context;

bool is_digit(char c);

/// "r_2" before "r_10": runs of digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b);

/// The PNG and JPEG files of a folder that are not hidden, in natural order.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// The images of IMAGE|DIR...: files as given, and images_in() folders; a note counts what else is there.
/// @throws IoError if a path is missing or a folder holds no image
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& paths, Context& context);

/// Reads an image as [H, W, 3]; grey is repeated, and `background` in [0, 1] fills transparent pixels.
/// @throws IoError as read_image()
Tensor<float> read_rgb(const std::filesystem::path& path, float background);

/// What was odd about several images, to be told when all are read: a line amid the progress would be lost.
struct ReadFaults {
  std::vector<std::string> warnings{};
  std::vector<std::pair<std::string, std::string>> unreadable{};  ///< image and reason

  /// Keeps what is odd about an image that is read, see jpeg_oddity().
  void check(const std::filesystem::path& image, std::span<const std::byte> bytes);
  /// Calls read(); an IoError is kept. @return whether there was none
  template <class F>
  bool try_read(const std::filesystem::path& image, F&& read) try {
    read();
    return true;
  } catch (const IoError& e) {
    unreadable.emplace_back(image.string(), e.what());
    return false;
  }
  /// Notes the warnings, and leaves out what is unreadable, see Context::leave_out().
  /// @param images  that were tried   @throws IoError if none of them could be read, with the first reason
  void tell(std::size_t images, Context& context) const;
};

}  // namespace fieldmark::cli
