#include "evidence_view.h"

#include <fieldmark/distort/jpeg444.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

nerf::CameraSpan trained() {
  nerf::CameraSpan span;
  span.fx = span.fy = 1.2;
  span.width = 400;
  span.height = 300;
  return span;
}

nerf::Camera camera_of(Index width, Index height) {
  nerf::Camera camera;
  camera.width = width;
  camera.height = height;
  camera.fx = camera.fy = 1.2 * static_cast<double>(std::max(width, height));
  camera.cx = 0.5 * static_cast<double>(width);
  camera.cy = 0.5 * static_cast<double>(height);
  return camera;
}

Surround grain(Index width, Index height) {
  const CounterRng rng(3, 1);
  Tensor<float> image({height, width, 3});
  for (Index i = 0; i < image.size(); ++i)
    image[i] = 0.5f + 0.1f * rng.normal2(static_cast<std::uint64_t>(i))[0];
  return {.image = quantize8(image), .plain = {}};
}

EvidenceView view_of(const Surround& seen, double shown) {
  return evidence_view(seen, camera_of(seen.image.shape[1], seen.image.shape[0]), shown, trained());
}

}  // namespace

TEST_CASE("evidence_view: an image with few pixels on the field is left as it is") {
  const Surround seen = grain(400, 300);
  const EvidenceView view = view_of(seen, 0.4);  // all 120,000 pixels; 48,000 show the field
  CHECK(view.seen.image.data == seen.image.data);
  CHECK(view.camera.width == 400);
  CHECK(view.camera.fx == 480);
  CHECK(!view.jpeg);
  CHECK(!view.small);
}

TEST_CASE("evidence_view: where more pixels show the field, about 48,000 of them are kept") {
  const Surround seen = grain(480, 360);
  for (const double shown : {0.5, 1.0}) {
    const EvidenceView view = view_of(seen, shown);
    const auto kept = shown * static_cast<double>(view.camera.width * view.camera.height);
    CHECK(kept > 0.98 * 48'000);
    CHECK(kept < 1.02 * 48'000);
    CHECK(view.seen.image.shape == Shape{view.camera.height, view.camera.width, 3});
    CHECK(view.seen.image.data == resize_area(seen.image, view.camera.height, view.camera.width).data);
    CHECK(view.zoom == 480. / static_cast<double>(view.camera.width));
    CHECK(!view.small);  // the image itself is not
  }
}

TEST_CASE("evidence_view: a compressed image keeps its size, because resizing hides its steps") {
  Surround seen = grain(480, 360);
  seen.image = distort::jpeg444(seen.image, 40);
  const EvidenceView view = view_of(seen, 1);
  CHECK(view.seen.image.data == seen.image.data);
  REQUIRE(view.jpeg);
  CHECK(view.jpeg->quality == 40);
  seen.plain = seen.image;  // as it came, before another background
  seen.image = grain(480, 360).image;
  CHECK(view_of(seen, 1).jpeg);
  std::swap(seen.image, seen.plain);
  CHECK(!view_of(seen, 1).jpeg);
}

TEST_CASE("evidence_view: a compressed image of more than 512 pixels does not count as compressed") {
  Surround seen = grain(520, 390);
  seen.image = distort::jpeg444(seen.image, 40);
  const EvidenceView view = view_of(seen, 0.1);
  CHECK(!view.jpeg);
  CHECK(view.camera.width == 512);
  CHECK(view.zoom == 1);
}

TEST_CASE("evidence_view: sides of one pixel stay") {
  const EvidenceView view = view_of(grain(600, 1), 1);
  CHECK(view.camera.width == 512);
  CHECK(view.camera.height == 1);
}

TEST_CASE("evidence_view: a large image is reduced to 512 pixels, with all that belongs to it") {
  Surround seen = grain(1024, 512);
  seen.plain = seen.image;
  seen.colour = {0.25f, 0.5f, 0.75f};
  seen.covered.assign(1024 * 512, 0);
  std::fill_n(seen.covered.begin(), 1024 * 256, std::uint8_t{1});
  const EvidenceView view = view_of(seen, 0.1);
  CHECK(view.camera.width == 512);
  CHECK(view.camera.height == 256);
  CHECK(std::abs(view.camera.fx - 1.2 * 512) < 1e-9);
  CHECK(view.seen.image.shape == Shape{256, 512, 3});
  CHECK(view.seen.plain.data == view.seen.image.data);
  CHECK(view.seen.colour == seen.colour);
  REQUIRE(view.seen.covered.size() == 512 * 256);
  CHECK(view.seen.covered[0] == 1);
  CHECK(view.seen.covered[511 + 255 * 512] == 0);
  CHECK(std::ranges::count(view.seen.covered, 1) == 512 * (128 + 2));  // and two rows beside
}

TEST_CASE("evidence_view: an image of less than 0.6 of the training images' scale is small, a crop is not") {
  CHECK(view_of(grain(236, 177), 1).small);
  CHECK(!view_of(grain(244, 183), 1).small);
  nerf::Camera crop = camera_of(400, 300);
  crop.width = crop.height = 100;
  CHECK(!evidence_view(grain(100, 100), crop, 1, trained()).small);
}
