#include "image_marker.h"
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("image_marker: the strength asked for, on 8 bits") {
  for (const HidingKind kind : {HidingKind::hidden, HidingKind::mbrs}) {
    CAPTURE(hiding_name(kind));
    const ImageMarker marker(kind, {.bits = 4, .channels = 4}, 1);
    const auto cover = quantize8(uniform<float>({32, 48, 3}, 0.3f, 0.7f, 1));
    const watermark::Message message{{1, 0, 0, 1}};
    for (const double mark_psnr : {25.0, 35.0}) {
      const auto marked = marker.mark(cover, message, mark_psnr);
      CHECK(psnr(marked, cover) == Approx(mark_psnr).margin(0.02));
      CHECK(quantize8(marked).data == marked.data);
    }
    const auto read = marker.read(cover);
    REQUIRE(read.size() == 4);
    CHECK(marker.accuracy(cover, read) == 1);
    watermark::Message other = read;
    other.bits[2] ^= 1;
    CHECK(marker.accuracy(cover, other) == 0.75);
  }
}

TEST_CASE("image_marker: what white takes away is made up for") {
  const ImageMarker marker(HidingKind::hidden, {.bits = 4, .channels = 4}, 1);
  auto cover = quantize8(uniform<float>({32, 48, 3}, 0.3f, 0.7f, 1));
  std::fill_n(cover.data.begin(), cover.size() / 2, 1.f);
  const auto marked = marker.mark(cover, {{1, 0, 0, 1}}, 30);
  CHECK(psnr(marked, cover) == Approx(30).margin(0.02));
}

TEST_CASE("image_marker: a mark that nobody would see is brought to its strength too") {
  ImageMarker marker(HidingKind::hidden, {.bits = 4, .channels = 4}, 1);
  for (const auto& e : marker.params.entries())
    if (e.name.starts_with("encoder/colour"))
      for (float& v : marker.params.values(marker.params.find(e.name))) v *= 1e-4f;
  const auto cover = quantize8(uniform<float>({32, 32, 3}, 0.3f, 0.7f, 1));
  CHECK(psnr(marker.mark(cover, {{1, 0, 0, 1}}, 30), cover) == Approx(30).margin(0.02));
}

TEST_CASE("image_marker: an image is marked and read tile by tile") {
  const ImageMarker marker(HidingKind::mbrs, {.bits = 4, .channels = 4, .tile = 32}, 1);
  const auto part = [](const Tensor<float>& from, Index top, Index left, Index side) {
    Tensor<float> out({side, side, 3});
    for (Index y = 0; y < side; ++y)
      for (Index k = 0; k < 3 * side; ++k)
        out[y * side * 3 + k] = from[((top + y) * from.shape[1] + left) * 3 + k];
    return out;
  };
  const watermark::Message message{{1, 0, 0, 1}};
  const auto cover = quantize8(uniform<float>({72, 80, 3}, 0.3f, 0.7f, 1));
  const auto marked = marker.mark(cover, message);
  CHECK(part(marked, 32, 32, 32).data == marker.mark(part(cover, 32, 32, 32), message).data);
  CHECK(part(marked, 64, 0, 8).data != part(cover, 64, 0, 8).data);  // the remainder of a side is marked too
  // White tiles are ignored if another tile has content.
  auto mostly_white = cover;
  std::fill(mostly_white.data.begin(), mostly_white.data.end(), 1.f);
  for (Index y = 0; y < 32; ++y)
    std::copy_n(cover.data.begin() + (y * 80 + 32) * 3, 96, mostly_white.data.begin() + (y * 80 + 32) * 3);
  CHECK(marker.read(mostly_white).bits == marker.read(part(cover, 0, 32, 32)).bits);
}

TEST_CASE("image_marker: errors") {
  CHECK_THROWS_WITH(ImageMarker(HidingKind::hidden, {.tile = 8}, 1),
                    "[image_marker] tile must be at least 16 pixels, got 8");
  const ImageMarker marker(HidingKind::hidden, {.bits = 4, .channels = 4}, 1);
  const Tensor<float> cover({16, 16, 3}), grey({16, 16, 1});
  CHECK_THROWS_WITH(marker.mark(cover, {{1, 0}}),
                    "[image_marker] message must have the network's 4 bits, got 2");
  CHECK_THROWS_AS(marker.read(grey), ShapeError);
}
