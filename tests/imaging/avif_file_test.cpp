#include "avif_file.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>

#include <cmath>

#include "imaging/media_samples.h"
#include "support/catch.h"
#include "support/library.h"

using namespace fieldmark;

namespace {
bool has_avif() { return library_or_skip(is_built_in(ImageFormat::avif), "the test of AVIF", "libavif-dev"); }
}  // namespace

TEST_CASE("avif_file: an image without loss comes back as it was") {
  if (!has_avif()) return;
  const auto x = decode_image(from_base64(kAvif), "x.jpg");
  CHECK(x.shape == Shape{8, 16, 3});
  CHECK(x.data == quarters().data);
}

TEST_CASE("avif_file: turned and mirrored as the file asks for it") {
  if (!has_avif()) return;
  const auto x = decode_image(from_base64(kAvifTurned), "x"), q = quarters();
  REQUIRE(x.shape == Shape{16, 8, 3});
  // After the counterclockwise turn the right side is on top; then top and bottom are exchanged: a
  // transposition.
  for (Index y = 0; y < 16; ++y)
    for (Index column = 0; column < 8; ++column)
      for (Index c = 0; c < 3; ++c) CHECK(x[(y * 8 + column) * 3 + c] == q[(column * 16 + y) * 3 + c]);
}

TEST_CASE("avif_file: ten bits and alpha") {
  if (!has_avif()) return;
  const auto deep = decode_image(from_base64(kAvifDeep), "deep");
  REQUIRE(deep.shape == Shape{8, 16, 3});
  for (Index i = 0; i < deep.size(); ++i) CHECK(std::abs(deep[i] - quarters()[i]) <= 1.0f / 1023);
  const auto alpha = decode_image(from_base64(kAvifAlpha), "alpha");
  REQUIRE(alpha.shape == Shape{8, 16, 4});
  for (Index p = 0; p < 128; ++p) {
    CHECK(alpha[4 * p + 3] == (p % 16 < 8 ? 1.f : 51.f / 255.f));
    for (Index c = 0; c < 3; ++c) CHECK(alpha[4 * p + c] == quarters()[3 * p + c]);
  }
}

TEST_CASE("avif_file: a file that is cut is an error with a reason") {
  if (!has_avif()) return;
  const auto avif = from_base64(kAvif);
  for (std::size_t size = 0; size < avif.size(); size += 5)
    CHECK_THROWS_AS(decode_image(std::span(avif).first(size), "cut"), IoError);
  CHECK_THROWS_WITH(decode_image(std::span(avif).first(avif.size() - 20), "cut.avif"),
                    Contains("cut.avif: expected a PNG, JPEG, WebP, AVIF or HEIC image, found " +
                             std::to_string(avif.size() - 20) + " bytes that do not decode: "));
}
