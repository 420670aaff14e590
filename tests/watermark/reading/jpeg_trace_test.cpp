#include "jpeg_trace.h"
#include <fieldmark/distort/jpeg444.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <limits>

#include "support/catch.h"
#include "watermark/reading/jpeg_view.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("find_jpeg: names quality and chroma of what was compressed, and nothing else") {
  for (const std::uint64_t seed : {1u, 2u}) {
    const Tensor<float> base = view_image(0.05f, seed);
    CHECK_FALSE(find_jpeg(base).has_value());
    for (const int quality : {10, 30, 50, 75, 90}) {
      INFO(quality);
      const auto half = find_jpeg(jpeg_round_trip(base, quality));
      REQUIRE(half.has_value());
      CHECK(half->quality == quality);
      CHECK(half->subsampled);
      const auto full = find_jpeg(distort::jpeg444(base, quality));
      REQUIRE(full.has_value());
      CHECK(full->quality == quality);
      CHECK_FALSE(full->subsampled);
    }
  }
  CHECK_FALSE(find_jpeg(Tensor<float>({40, 40, 3})).has_value());
  CHECK_FALSE(find_jpeg(Tensor<float>({0, 40, 3})).has_value());
  CHECK_FALSE(find_jpeg(Tensor<float>({40, 40, 3}, std::numeric_limits<float>::quiet_NaN())).has_value());
}

TEST_CASE("find_jpeg: blocks in which the decoder clipped do not hide the rest") {
  for (const int quality : {10, 50}) {
    Tensor<float> x = view_image(0.05f, 1);
    for (Index p = 0; p < kJpegViewHeight * kJpegViewWidth;
         ++p)  // an object before white, whose edge passes many blocks
      if ((p / kJpegViewWidth - 2 * (p % kJpegViewWidth / 4)) % 32 < 12) std::fill_n(&x[3 * p], 3, 1.f);
    const auto half = find_jpeg(jpeg_round_trip(x, quality));
    REQUIRE(half.has_value());
    CHECK(half->quality == quality);
    CHECK(half->subsampled);
  }
}
