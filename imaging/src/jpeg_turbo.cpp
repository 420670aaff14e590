#include "jpeg_turbo.h"

#include <fieldmark/core/error.h>

#include "fieldmark/imaging/image_format.h"

#ifdef FIELDMARK_WITH_JPEG
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>
// Must follow <cstdio>, which it needs.
#include <jpeglib.h>
#endif

namespace fieldmark {

#ifdef FIELDMARK_WITH_JPEG
namespace {

// libjpeg ends the program on an error unless the handler jumps away; the handler must not return.
struct Failure {
  jpeg_error_mgr manager{};
  std::jmp_buf place{};
  char text[JMSG_LENGTH_MAX]{};
};

void fail(j_common_ptr codec) {
  auto& failure = *reinterpret_cast<Failure*>(codec->err);
  codec->err->format_message(codec, failure.text);
  std::longjmp(failure.place, 1);
}

struct Work {
  jpeg_compress_struct codec{};
  unsigned char* file = nullptr;
  unsigned long size = 0;
};

// Contains no object with a destructor, which a longjmp would skip.
bool compress(Work& work, Failure& failure, const std::uint8_t* pixels, int height, int width, int channels,
              int quality, bool full_chroma) {
  jpeg_compress_struct& codec = work.codec;
  if (setjmp(failure.place)) return false;
  jpeg_create_compress(&codec);
  jpeg_mem_dest(&codec, &work.file, &work.size);
  codec.image_width = static_cast<JDIMENSION>(width);
  codec.image_height = static_cast<JDIMENSION>(height);
  codec.input_components = channels;
  codec.in_color_space = channels == 3 ? JCS_RGB : JCS_GRAYSCALE;
  jpeg_set_defaults(&codec);
  jpeg_set_quality(&codec, quality, TRUE);
  codec.dct_method = JDCT_ISLOW;
  if (channels == 3)
    codec.comp_info[0].h_samp_factor = codec.comp_info[0].v_samp_factor = full_chroma ? 1 : 2;
  jpeg_start_compress(&codec, TRUE);
  while (codec.next_scanline < codec.image_height) {
    const std::size_t at =
        std::size_t{codec.next_scanline} * codec.image_width * static_cast<std::size_t>(channels);
    auto* row = const_cast<JSAMPROW>(pixels + at);
    jpeg_write_scanlines(&codec, &row, 1);
  }
  jpeg_finish_compress(&codec);
  return true;
}

}  // namespace

bool has_jpeg_turbo() { return true; }

std::vector<std::byte> encode_jpeg_turbo(std::span<const std::uint8_t> pixels, int height, int width,
                                         int channels, int quality, bool full_chroma) {
  Work work;
  Failure failure;
  work.codec.err = jpeg_std_error(&failure.manager);
  failure.manager.error_exit = fail;
  const bool done = compress(work, failure, pixels.data(), height, width, channels, quality, full_chroma);
  jpeg_destroy_compress(&work.codec);
  const std::unique_ptr<unsigned char, decltype(&std::free)> file(work.file, std::free);
  if (!done) throw Error("[encode_jpeg] libjpeg-turbo: " + std::string(failure.text));
  const auto* first = reinterpret_cast<const std::byte*>(work.file);
  return {first, first + work.size};
}

#else

bool has_jpeg_turbo() { return false; }

std::vector<std::byte> encode_jpeg_turbo(std::span<const std::uint8_t>, int, int, int, int, bool) {
  throw ValueError("[encode_jpeg] " + missing_library("JPEG files with quality above 90 or full chroma",
                                                      "libjpeg-turbo", "libjpeg62-turbo-dev"));
}

#endif

}  // namespace fieldmark
