#include "heic_file.h"

#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/image_format.h>

#include <cmath>

#include "imaging/media_samples.h"
#include "support/catch.h"
#include "support/library.h"

using namespace fieldmark;

namespace {
bool has_heic() { return library_or_skip(is_built_in(ImageFormat::heic), "the test of HEIC", "libheif-dev"); }
}  // namespace

TEST_CASE("heic_file: colours come back, in eight bits and in ten") {
  if (!has_heic()) return;
  for (const auto sample : {kHeic, kHeicDeep}) {
    const auto x = decode_image(from_base64(sample), "x.png");
    REQUIRE(x.shape == Shape{8, 16, 3});
    for (Index i = 0; i < x.size(); ++i) CHECK(std::abs(x[i] - quarters()[i]) < 8.0f / 255);
  }
  const auto x = decode_image(from_base64(kHeic), "x");
  CHECK(quantize8(x).data == x.data);
}

TEST_CASE("heic_file: a file that is cut is an error with a reason") {
  if (!has_heic()) return;
  const auto heic = from_base64(kHeic);
  for (std::size_t size = 0; size < heic.size(); size += 9)
    CHECK_THROWS_AS(decode_image(std::span(heic).first(size), "cut"), IoError);
  CHECK_THROWS_WITH(decode_image(std::span(heic).first(100), "cut.heic"),
                    Contains("cut.heic: expected a PNG"));
}
