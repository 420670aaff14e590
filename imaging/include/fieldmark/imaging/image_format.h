#pragma once
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark {

/// What the first bytes of a file say it is.
enum class ImageFormat {
  unknown,  ///< none of the others
  png,      ///< read by stb
  jpeg,     ///< read by stb
  webp,     ///< read by libwebp
  avif,     ///< read by libavif
  heic,     ///< read by libheif
  video     ///< MP4, MOV or WebM: no image; imaging/video reads it
};
/// The format of a file. @param bytes  the whole file, or at least its first 64 bytes
ImageFormat image_format(std::span<const std::byte> bytes);
/// As above, from the file's first bytes. @throws IoError if it cannot be read
ImageFormat image_format(const std::filesystem::path& path);

/// A name for people: "PNG", "video".
std::string_view format_name(ImageFormat format);
/// Whether this build reads the format: all but PNG and JPEG need a library that may have been missing when
/// Fieldmark was built. False for video, see has_video().
bool is_built_in(ImageFormat format);
/// "WebP images need libwebp, which this build of Fieldmark lacks; install libwebp-dev and build again".
/// @param what      "WebP images"   @param library  "libwebp"   @param package  of Debian, "libwebp-dev"
std::string missing_library(std::string_view what, std::string_view library, std::string_view package);

/// The extensions of image files, in lower case: ".png", ".jpg", ... The content decides what a file is; its
/// name, whether a folder's file is taken for an image at all.
std::span<const std::string_view> image_extensions();
/// Whether a name has one of image_extensions(), in any case.
bool has_image_extension(const std::filesystem::path& path);

/// What is odd about a PNG or JPEG file that read_image() passes over: other data behind its end, as of
/// telephones that append a film, or no end marker behind an image that is complete.
/// @param bytes  of the whole file   @return a text for a warning; empty where nothing is, and for other
/// formats
std::string image_oddity(std::span<const std::byte> bytes);

}  // namespace fieldmark
