#include "webp_file.h"

#include <fieldmark/engine/shape_checks.h>

#include "decoding.h"
#include "fieldmark/imaging/image.h"
#include "fieldmark/imaging/image_format.h"

#ifdef FIELDMARK_WITH_WEBP
#include <webp/decode.h>
#include <webp/encode.h>

#include <memory>
#endif

namespace fieldmark {

#ifdef FIELDMARK_WITH_WEBP
namespace {

const std::uint8_t* data_of(std::span<const std::byte> bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

std::string reason_of(VP8StatusCode status) {
  switch (status) {
    case VP8_STATUS_NOT_ENOUGH_DATA:
      return "truncated";
    case VP8_STATUS_OUT_OF_MEMORY:
      return "no memory";
    case VP8_STATUS_UNSUPPORTED_FEATURE:
      return "a feature that libwebp does not support";
    default:
      return "damaged";
  }
}

}  // namespace

Tensor<float> decode_webp(std::span<const std::byte> bytes) {
  WebPDecoderConfig config;
  if (!WebPInitDecoderConfig(&config)) throw Undecodable("libwebp is of another version than its headers");
  if (const auto status = WebPGetFeatures(data_of(bytes), bytes.size(), &config.input);
      status != VP8_STATUS_OK)
    throw Undecodable(reason_of(status));
  if (config.input.has_animation) throw Undecodable("an animation, where a still image was expected");
  const Index width = config.input.width, height = config.input.height,
              channels = config.input.has_alpha ? 4 : 3;
  check_area(width, height, bytes.size());
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height * channels));
  config.output.colorspace = channels == 4 ? MODE_RGBA : MODE_RGB;
  config.output.is_external_memory = 1;
  config.output.u.RGBA = {
      .rgba = pixels.data(), .stride = static_cast<int>(width * channels), .size = pixels.size()};
  if (const auto status = WebPDecode(data_of(bytes), bytes.size(), &config); status != VP8_STATUS_OK)
    throw Undecodable(reason_of(status));
  return from_rows<std::uint8_t>(pixels.data(), static_cast<std::size_t>(width * channels), height, width,
                                 channels, 255.f);
}

std::vector<std::byte> encode_webp(const Tensor<float>& image, int quality) {
  const Shape& s = image.shape;
  check_rank("encode_webp", "image", s, 3, "[height, width, channels]");
  if ((s[2] != 3 && s[2] != 4) || s[0] < 1 || s[1] < 1 || s[0] > WEBP_MAX_DIMENSION ||
      s[1] > WEBP_MAX_DIMENSION)
    throw ShapeError("[encode_webp] image: height and width must be from 1 to " +
                     std::to_string(WEBP_MAX_DIMENSION) + ", channels 3 or 4, got shape " + s.str());
  if (quality < 1 || quality > 100)
    throw ValueError("[encode_webp] quality must be from 1 to 100, got " + std::to_string(quality));
  const auto pixels = bytes_of(image);
  const int height = static_cast<int>(s[0]), width = static_cast<int>(s[1]),
            stride = static_cast<int>(s[1] * s[2]);
  const auto encode = s[2] == 4 ? WebPEncodeRGBA : WebPEncodeRGB;
  std::uint8_t* file = nullptr;
  const std::size_t size = encode(pixels.data(), width, height, stride, static_cast<float>(quality), &file);
  const std::unique_ptr<std::uint8_t, decltype(&WebPFree)> kept(file, WebPFree);
  if (size == 0) throw Error("[encode_webp] libwebp refused shape " + s.str());
  const auto* first = reinterpret_cast<const std::byte*>(file);
  return {first, first + size};
}

#else

Tensor<float> decode_webp(std::span<const std::byte>) {
  throw Undecodable(missing_library("WebP images", "libwebp", "libwebp-dev"));
}
std::vector<std::byte> encode_webp(const Tensor<float>&, int) {
  throw ValueError("[encode_webp] " + missing_library("WebP images", "libwebp", "libwebp-dev"));
}

#endif

Tensor<float> webp_round_trip(const Tensor<float>& image, int quality) {
  return decode_image(encode_webp(image, quality), "WebP in memory");
}

}  // namespace fieldmark
