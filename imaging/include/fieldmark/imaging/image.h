#pragma once
#include <fieldmark/engine/tensor.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>
#include <vector>

namespace fieldmark {

// Images are [height, width, channels] with 1 to 4 channels. Values are in [0, 1] as stored in the file
// (sRGB, not linearised).

/// Reads a PNG, JPEG, WebP, AVIF or HEIC file, whatever its name. Values are multiples of 1/255 (of 1/65535
/// for 16 bits); the channels are those of the file (a palette becomes 3 or 4). A PNG or JPEG file may lack
/// its end marker or have other data after it, see image_oddity(). AVIF and HEIC images are turned upright;
/// for JPEG and WebP see exif_orientation().
/// @throws IoError if it is missing, truncated, not an image, larger than 2^26 + 4 bytes of the file pixels,
/// or of a format whose library this build lacks, see is_built_in()
Tensor<float> read_image(const std::filesystem::path& path);
/// Decodes an image from memory, as read_image(). @param name  stands for the path in error messages
Tensor<float> decode_image(std::span<const std::byte> bytes, std::string_view name);

/// Writes an 8-bit PNG atomically, see quantize8().
/// @throws ShapeError unless [H, W, 1..4], both at least 1   @throws IoError if writing fails
void write_png(const std::filesystem::path& path, const Tensor<float>& image);

/// The chroma resolution of a JPEG file.
enum class Chroma {
  halved,  ///< 4:2:0: half the width and height
  full     ///< 4:4:4
};
/// Encodes a baseline JPEG file with the quantisation tables of ITU-T T.81, annex K, scaled as libjpeg does.
/// libjpeg-turbo does the encoding, except for halved chroma up to quality 90, where stb does: recorded
/// results depend on its exact bits.
/// @param image  [H, W, 1 or 3], at most 65535 per side; rounded to 8 bits first   @param quality  1 to 100
/// @throws ShapeError   @throws ValueError also if this build lacks libjpeg-turbo
std::vector<std::byte> encode_jpeg(const Tensor<float>& image, int quality, Chroma chroma = Chroma::halved);
/// Encodes with encode_jpeg() and decodes; keeps the shape.
Tensor<float> jpeg_round_trip(const Tensor<float>& image, int quality, Chroma chroma = Chroma::halved);

/// Encodes a lossy WebP file with the default settings of libwebp.
/// @param image  [H, W, 3 or 4], at most 16383 per side; rounded to 8 bits first   @param quality  1 to 100
/// @throws ShapeError   @throws ValueError also if this build lacks libwebp
std::vector<std::byte> encode_webp(const Tensor<float>& image, int quality);
/// Encodes with encode_webp() and decodes. Keeps the shape, but opaque 4-channel images may lose the last.
Tensor<float> webp_round_trip(const Tensor<float>& image, int quality);

/// Computes floor(255 clamp(x, 0, 1) + 1/2) for each value; NaN becomes 0.
std::vector<std::uint8_t> bytes_of(const Tensor<float>& image);
/// Computes bytes_of() / 255, the values that a PNG file stores. Idempotent; any shape.
Tensor<float> quantize8(const Tensor<float>& image);

/// Copies `image` into `canvas` with its upper left corner at (row, column).
/// @throws ShapeError if the channels differ or it does not fit
void paste(Tensor<float>& canvas, const Tensor<float>& image, Index row, Index column);
/// Makes a contact sheet: images in reading order, aligned upper left in cells of the largest height and
/// width.
/// @param columns  at least 1   @param gap  pixels between cells, >= 0   @param background  value of empty
/// pixels
/// @return [rows (H + gap) - gap, columns' (W + gap) - gap, C], columns' = min(columns, images)
/// @throws ValueError if there is no image, or columns or gap is out of range   @throws ShapeError if the
/// channels differ
Tensor<float> tile(std::span<const Tensor<float>> images, Index columns, Index gap, float background = 1);

}  // namespace fieldmark
