#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace fieldmark {

// Images are [height, width, channels] of 1 to 4 channels, values in [0, 1] as the file has them (sRGB, no
// gamma).

/// Reads a PNG, JPEG, WebP, AVIF or HEIC file, whatever its name: multiples of 1/255 (of 1/65535 for 16
/// bits), channels as in the file (a palette becomes 3 or 4). A PNG or JPEG file may lack its end marker or
/// have other data behind it, see image_oddity(). An AVIF or HEIC file is turned as it asks for; for JPEG and
/// WebP see exif_orientation().
/// @throws IoError if it is missing, truncated, no image, larger than 2^26 + 4 bytes of the file pixels, or
/// of a format whose library this build lacks, see is_built_in()
Tensor<float> read_image(const std::filesystem::path& path);
/// As read_image(), from memory. @param name  stands for the path in error texts
Tensor<float> decode_image(std::span<const std::byte> bytes, std::string_view name);

/// Writes an 8-bit PNG (see quantize8()), which appears when it is complete.
/// @throws ShapeError unless [H, W, 1..4], both at least 1   @throws IoError if writing fails
void write_png(const std::filesystem::path& path, const Tensor<float>& image);

/// The chroma of a JPEG file.
enum class Chroma {
  halved,  ///< 4:2:0: half the width and height
  full     ///< 4:4:4
};
/// A baseline JPEG file with the quantisation tables of ITU-T T.81, annex K, scaled as libjpeg does.
/// libjpeg-turbo writes it; with halved chroma up to quality 90 stb does, whose bits recorded results depend
/// on.
/// @param image  [H, W, 1 or 3], at most 65535 each way; rounded to 8 bits first   @param quality  1 to 100
/// @throws ShapeError   @throws ValueError also if this build lacks libjpeg-turbo
std::vector<std::byte> encode_jpeg(const Tensor<float>& image, int quality, Chroma chroma = Chroma::halved);
/// encode_jpeg() and decode; same shape.
Tensor<float> jpeg_round_trip(const Tensor<float>& image, int quality, Chroma chroma = Chroma::halved);

/// A lossy WebP file, by libwebp with its default settings.
/// @param image  [H, W, 3 or 4], at most 16383 each way; rounded to 8 bits first   @param quality  1 to 100
/// @throws ShapeError   @throws ValueError also if this build lacks libwebp
std::vector<std::byte> encode_webp(const Tensor<float>& image, int quality);
/// encode_webp() and decode; same shape, but opaque images of 4 channels may lose the last.
Tensor<float> webp_round_trip(const Tensor<float>& image, int quality);

/// floor(255 clamp(x, 0, 1) + 1/2) for each value; 0 for NaN.
std::vector<std::uint8_t> bytes_of(const Tensor<float>& image);
/// bytes_of() / 255, as a PNG file holds the image. Idempotent; any shape.
Tensor<float> quantize8(const Tensor<float>& image);

/// Copies `image` into `canvas` with its upper left corner at (row, column).
/// @throws ShapeError if channels differ or it does not fit
void paste(Tensor<float>& canvas, const Tensor<float>& image, Index row, Index column);
/// Contact sheet: images in reading order, in cells of the largest height and width, upper left in each.
/// @param columns  at least 1   @param gap  pixels between cells, >= 0   @param background  value of empty
/// pixels
/// @return [rows (H + gap) - gap, columns' (W + gap) - gap, C], columns' = min(columns, images)
/// @throws ValueError if there is no image or columns or gap is out of range   @throws ShapeError if channels
/// differ
Tensor<float> tile(std::span<const Tensor<float>> images, Index columns, Index gap, float background = 1);

}  // namespace fieldmark
