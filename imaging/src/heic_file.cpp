#include "heic_file.h"

#include "decoding.h"
#include "fieldmark/imaging/image_format.h"

#ifdef FIELDMARK_WITH_HEIC
#include <libheif/heif.h>

#include <memory>
#endif

namespace fieldmark {

#ifdef FIELDMARK_WITH_HEIC
namespace {

void need(const heif_error& error) {
  if (error.code != heif_error_Ok) throw Undecodable(error.message);
}

heif_chroma chroma_of(bool alpha, bool deep) {
  if (deep) return alpha ? heif_chroma_interleaved_RRGGBBAA_LE : heif_chroma_interleaved_RRGGBB_LE;
  return alpha ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB;
}

}  // namespace

Tensor<float> decode_heic(std::span<const std::byte> bytes) {
  const std::unique_ptr<heif_context, decltype(&heif_context_free)> context(heif_context_alloc(),
                                                                            heif_context_free);
  need(heif_context_read_from_memory_without_copy(context.get(), bytes.data(), bytes.size(), nullptr));
  heif_context_set_max_decoding_threads(context.get(), 0);
  heif_image_handle* found = nullptr;
  need(heif_context_get_primary_image_handle(context.get(), &found));
  const std::unique_ptr<heif_image_handle, decltype(&heif_image_handle_release)> handle(
      found, heif_image_handle_release);
  check_area(heif_image_handle_get_width(found), heif_image_handle_get_height(found), bytes.size());
  const bool alpha = heif_image_handle_has_alpha_channel(found) != 0;
  const bool deep = heif_image_handle_get_luma_bits_per_pixel(found) > 8;
  heif_image* decoded = nullptr;
  need(heif_decode_image(found, &decoded, heif_colorspace_RGB, chroma_of(alpha, deep), nullptr));
  const std::unique_ptr<heif_image, decltype(&heif_image_release)> image(decoded, heif_image_release);
  int stride = 0;
  const std::uint8_t* rows = heif_image_get_plane_readonly(decoded, heif_channel_interleaved, &stride);
  const Index height = heif_image_get_height(decoded, heif_channel_interleaved),
              width = heif_image_get_width(decoded, heif_channel_interleaved), channels = alpha ? 4 : 3;
  if (!rows || stride <= 0) throw Undecodable("no pixels");
  check_area(width, height, bytes.size());
  if (!deep)
    return from_rows<std::uint8_t>(rows, static_cast<std::size_t>(stride), height, width, channels, 255.f);
  const int bits = heif_image_get_bits_per_pixel_range(decoded, heif_channel_interleaved);
  if (bits < 9 || bits > 16) throw Undecodable(std::to_string(bits) + " bits a channel");
  return from_rows<std::uint16_t>(rows, static_cast<std::size_t>(stride), height, width, channels,
                                  static_cast<float>((1 << bits) - 1));
}

#else

Tensor<float> decode_heic(std::span<const std::byte>) {
  throw Undecodable(missing_library("HEIC images", "libheif", "libheif-dev"));
}

#endif

}  // namespace fieldmark
