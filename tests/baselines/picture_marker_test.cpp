#include <fieldmark/baselines/picture_marker.h>
#include <fieldmark/engine/image.h>
#include <fieldmark/engine/metrics.h>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("picture_marker: the strength asked for, on 8 bits") {
  for (const HidingKind kind : {HidingKind::hidden, HidingKind::mbrs}) {
    CAPTURE(hiding_name(kind));
    const PictureMarker marker(kind, {.bits = 4, .channels = 4}, 1);
    const auto picture = quantize8(uniform<float>({32, 48, 3}, 0.3f, 0.7f, 1));
    const watermark::Message message{{1, 0, 0, 1}};
    for (const double strength : {25.0, 35.0}) {
      const auto marked = marker.mark(picture, message, strength);
      CHECK(psnr(marked, picture) == Approx(strength).margin(0.02));
      CHECK(quantize8(marked).data == marked.data);
    }
    const auto read = marker.read(picture);
    REQUIRE(read.size() == 4);
    CHECK(marker.accuracy(picture, read) == 1);
    watermark::Message other = read;
    other.bits[2] ^= 1;
    CHECK(marker.accuracy(picture, other) == 0.75);
  }
}

TEST_CASE("picture_marker: what white takes away is made up for") {
  const PictureMarker marker(HidingKind::hidden, {.bits = 4, .channels = 4}, 1);
  auto picture = quantize8(uniform<float>({32, 48, 3}, 0.3f, 0.7f, 1));
  std::fill_n(picture.data.begin(), picture.size() / 2, 1.f);
  const auto marked = marker.mark(picture, {{1, 0, 0, 1}}, 30);
  CHECK(psnr(marked, picture) == Approx(30).margin(0.02));
}

TEST_CASE("picture_marker: errors") {
  const PictureMarker marker(HidingKind::hidden, {.bits = 4, .channels = 4}, 1);
  const Tensor<float> picture({16, 16, 3}), grey({16, 16, 1});
  CHECK_THROWS_WITH(marker.mark(picture, {{1, 0}}),
                    "[picture_marker] message must have the network's 4 bits, got 2");
  CHECK_THROWS_AS(marker.read(grey), ShapeError);
}
