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

/// Returns the extension of a path in lower case, such as ".png".
std::string extension_of(const std::filesystem::path& path);

/// Orders "r_2" before "r_10": runs of digits compare as numbers.
bool natural_less(const std::string& a, const std::string& b);

/// Returns the visible image files of a folder, see has_image_extension(), in natural order.
std::vector<std::filesystem::path> images_in(const std::filesystem::path& folder);

/// Whether a command reads videos besides images.
enum class Videos { refused, read };

/// Lists the images of IMAGE|DIR...: files as given, and for folders images_in() plus, if they are read,
/// videos. A note counts the other files.
/// @throws IoError if a path is missing or a folder holds no image
std::vector<std::filesystem::path> list_images(const std::vector<std::string>& paths, Context& context,
                                               Videos videos = Videos::refused);

/// Decodes an image with decode_image() and turns it upright, see exif_orientation().
Tensor<float> decode_upright(std::span<const std::byte> bytes, const std::string& name);
/// Decodes an image file as [H, W, 3], upright. Grey is repeated over the channels; `background` in [0, 1]
/// fills transparent pixels.
/// @throws IoError as decode_image(), with the name
Tensor<float> decode_rgb(std::span<const std::byte> bytes, const std::string& name, float background);
/// Overload that reads a file. @throws IoError also if it cannot be read
Tensor<float> read_rgb(const std::filesystem::path& path, float background);

/// Collects what was odd about several images and reports it at the end: amid the progress it would be lost.
struct ReadFaults {
  std::vector<std::string> warnings{};
  std::vector<std::pair<std::string, std::string>> unreadable{};  ///< images and reasons

  /// Records what is odd about an image that was read, see image_oddity().
  void check(const std::filesystem::path& image, std::span<const std::byte> bytes);
  /// Calls read() and records an IoError. @return true if there was none
  template <class F>
  bool try_read(const std::filesystem::path& image, F&& read) try {
    read();
    return true;
  } catch (const IoError& e) {
    unreadable.emplace_back(image.string(), e.what());
    return false;
  }
  /// Prints the warnings as notes, and leaves out the unreadable images, see Context::leave_out().
  /// @param any_read  true if an image could be read   @throws IoError with the first reason if none could
  void tell(bool any_read, Context& context) const;
};

}  // namespace fieldmark::cli
