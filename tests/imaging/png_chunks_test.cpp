#include "png_chunks.h"

#include <vector>

#include "imaging/jpeg_bytes.h"
#include "support/catch.h"

using namespace fieldmark;

namespace {
// A signature, a chunk of pixels of two bytes, and the end chunk.
std::vector<std::byte> file() {
  return bytes_from({0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n', 0, 0,   0,   2,   'I', 'D', 'A', 'T', 7,
                     7,    0,   0,   0,   0,    0,    0,    0,    0, 'I', 'E', 'N', 'D', 1,   2,   3,   4});
}
}  // namespace

TEST_CASE("png_chunks: to the end chunk and no further") {
  auto png = file();
  const std::size_t size = png.size();
  CHECK(is_png(png));
  append(png, bytes_from({0, 0, 0, 0, 'I', 'E', 'N', 'D', 0}));
  const auto chunks = png_chunks(png);
  CHECK((chunks.complete && chunks.has_data));
  CHECK(chunks.end == size);
  CHECK(chunks.lacks == 0);
}

TEST_CASE("png_chunks: what a cut leaves") {
  const auto png = file();
  for (std::size_t size = 8; size < png.size(); ++size) {
    const auto chunks = png_chunks(std::span(png).first(size));
    INFO(size);
    CHECK(chunks.end <= size);
    CHECK(chunks.has_data == (size >= 18));
    CHECK(chunks.complete == (size >= 30));  // a missing checksum of the end chunk does no harm
    if (size < 18) CHECK(chunks.end == 8);
    if (size >= 18 && size < 22) CHECK(chunks.lacks == 22 - size);
  }
  CHECK(!is_png(std::span(png).first(7)));
  CHECK(!is_png({}));
}
