#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark {

/// File format according to the first bytes.
enum class ImageFormat {
  unknown,  ///< none of the others
  png,      ///< read by stb
  jpeg,     ///< read by stb
  webp,     ///< read by libwebp
  avif,     ///< read by libavif
  heic,     ///< read by libheif
  video     ///< MP4, MOV or WebM: not an image; imaging/video reads it
};
/// Detects the format of a file. @param bytes  the whole file, or at least its first 64 bytes
ImageFormat image_format(std::span<const std::byte> bytes);
/// Overload that reads the first bytes of a file. @throws IoError if it cannot be read
ImageFormat image_format(const std::filesystem::path& path);

/// Returns the display name of a format: "PNG", "video".
std::string_view format_name(ImageFormat format);
/// True if this build reads the format. All formats but PNG and JPEG need a library that may be missing at
/// build time. False for video, see has_video().
bool is_built_in(ImageFormat format);
/// Returns "WebP images need libwebp, which this build of Fieldmark lacks; install libwebp-dev and build
/// again".
/// @param what      "WebP images"   @param library  "libwebp"   @param package  Debian package, "libwebp-dev"
std::string missing_library(std::string_view what, std::string_view library, std::string_view package);

/// Returns the extensions of image files in lower case: ".png", ".jpg", ... The extension decides whether a
/// file of a folder counts as an image; the content decides its format.
std::span<const std::string_view> image_extensions();
/// True if a name has one of image_extensions(), in any case.
bool has_image_extension(const std::filesystem::path& path);

/// Describes what is odd about a PNG or JPEG file that read_image() tolerates: data after its end, such as
/// the film that some phones append, or a missing end marker after a complete image.
/// @param bytes  the whole file   @return text for a warning; empty if nothing is odd, and for other formats
std::string image_oddity(std::span<const std::byte> bytes);

}  // namespace fieldmark
