#include "avif_file.h"

#include "decoding.h"
#include "fieldmark/imaging/exif.h"
#include "fieldmark/imaging/image_format.h"

#ifdef FIELDMARK_WITH_AVIF
#include <avif/avif.h>

#include <algorithm>
#include <memory>
#include <vector>
#endif

namespace fieldmark {

#ifdef FIELDMARK_WITH_AVIF
namespace {

// In the order of ISO/IEC 23008-12: rotated first, then mirrored.
Tensor<float> as_asked(Tensor<float> image, const avifImage& from) {
  constexpr int kCounterclockwise[] = {1, 8, 3, 6};  // EXIF orientations by quarter turns
  if (from.transformFlags & AVIF_TRANSFORM_IROT)
    image = turned(image, kCounterclockwise[from.irot.angle % 4]);
  if (from.transformFlags & AVIF_TRANSFORM_IMIR) image = turned(image, from.imir.mode == 0 ? 4 : 2);
  return image;
}

}  // namespace

Tensor<float> decode_avif(std::span<const std::byte> bytes) {
  const std::unique_ptr<avifDecoder, decltype(&avifDecoderDestroy)> decoder(avifDecoderCreate(),
                                                                            avifDecoderDestroy);
  if (!decoder) throw Undecodable("no memory");
  decoder->imageSizeLimit = static_cast<std::uint32_t>(
      std::min<std::int64_t>(max_area(bytes.size()), AVIF_DEFAULT_IMAGE_SIZE_LIMIT));
  decoder->strictFlags = AVIF_STRICT_ENABLED & ~AVIF_STRICT_PIXI_REQUIRED;  // many encoders omit it
  decoder->ignoreExif = decoder->ignoreXMP = AVIF_TRUE;
  // dav1d reports damage on standard error.
  if (avifCodecName(AVIF_CODEC_CHOICE_AOM, AVIF_CODEC_FLAG_CAN_DECODE))
    decoder->codecChoice = AVIF_CODEC_CHOICE_AOM;
  const auto need = [&](avifResult result) {
    if (result == AVIF_RESULT_OK) return;
    const char* more = decoder->diag.error;
    throw Undecodable(std::string(avifResultToString(result)) + (*more ? ": " : "") + more);
  };
  need(avifDecoderSetIOMemory(decoder.get(), reinterpret_cast<const std::uint8_t*>(bytes.data()),
                              bytes.size()));
  need(avifDecoderParse(decoder.get()));
  need(avifDecoderNextImage(decoder.get()));
  const avifImage& image = *decoder->image;
  check_area(image.width, image.height, bytes.size());
  avifRGBImage rgb;
  avifRGBImageSetDefaults(&rgb, &image);
  rgb.format = image.alphaPlane ? AVIF_RGB_FORMAT_RGBA : AVIF_RGB_FORMAT_RGB;
  rgb.depth = image.depth > 8 ? 16 : 8;
  rgb.chromaUpsampling = AVIF_CHROMA_UPSAMPLING_BILINEAR;
  rgb.avoidLibYUV = AVIF_TRUE;  // the same bits on every CPU
  rgb.rowBytes = image.width * avifRGBImagePixelSize(&rgb);
  std::vector<std::uint8_t> pixels(std::size_t{rgb.rowBytes} * image.height);
  rgb.pixels = pixels.data();
  need(avifImageYUVToRGB(&image, &rgb));
  const Index channels = image.alphaPlane ? 4 : 3;
  const auto* rows = pixels.data();
  return as_asked(
      rgb.depth > 8
          ? from_rows<std::uint16_t>(rows, rgb.rowBytes, image.height, image.width, channels, 65535.f)
          : from_rows<std::uint8_t>(rows, rgb.rowBytes, image.height, image.width, channels, 255.f),
      image);
}

#else

Tensor<float> decode_avif(std::span<const std::byte>) {
  throw Undecodable(missing_library("AVIF images", "libavif", "libavif-dev"));
}

#endif

}  // namespace fieldmark
