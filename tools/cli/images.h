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

/// The image files of a folder that are not hidden, see has_image_extension(), in natural order.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// Whether a command reads videos as well as images.
enum class Videos { refused, read };

/// The images of IMAGE|DIR...: files as given, and of folders what images_in() lists, with videos if they are
/// read; a note counts what else is there.
/// @throws IoError if a path is missing or a folder holds no image
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& paths, Context& context,
                                               Videos videos = Videos::refused);

/// decode_image(), turned as exif_orientation() asks for it.
Tensor<float> decode_upright(std::span<const std::byte> bytes, const std::string& name);
/// An image file's bytes as [H, W, 3], upright; grey is repeated, and `background` in [0, 1] fills
/// transparent pixels.
/// @throws IoError as decode_image(), with the name
Tensor<float> decode_rgb(std::span<const std::byte> bytes, const std::string& name, float background);
/// decode_rgb() of a file. @throws IoError also if it cannot be read
Tensor<float> read_rgb(const std::filesystem::path& path, float background);

/// What was odd about several images, to be told when all are read: a line amid the progress would be lost.
struct ReadFaults {
  std::vector<std::string> warnings{};
  std::vector<std::pair<std::string, std::string>> unreadable{};  ///< image and reason

  /// Keeps what is odd about an image that is read, see image_oddity().
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
  /// @param any_read  whether an image could be read   @throws IoError if none could, with the first reason
  void tell(bool any_read, Context& context) const;
};

}  // namespace fieldmark::cli
