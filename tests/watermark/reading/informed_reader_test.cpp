#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>
#include <fieldmark/watermark/reading/informed_reader.h>

#include <cmath>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr CameraSearchOptions kSearch{.views = 40, .size = 32};
const Message kReadMessage{{1, 0, 0, 1}};

nerf::Camera camera_near(std::uint64_t seed) {
  return nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, 96, seed).front();
}

Tensor<float> image_of(const Owner& owner, const nerf::Camera& camera, bool marked) {
  nerf::Renderer renderer(owner.field);
  if (marked) renderer.set_recolour(owner.marking(cell_signs(owner.code(), kReadMessage)));
  return quantize8(renderer.render(camera).rgb);
}
}  // namespace

TEST_CASE("informed_reader: with the camera known every bit is read, whatever gain and offset") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    Tensor<float> view_image = image_of(owner, camera_near(seed), true);
    for (Index i = 0; i < view_image.size(); ++i) view_image[i] = 0.8f * view_image[i] + 0.05f;
    const auto evidence = reader.evidence_at(quantize8(view_image), camera_near(seed));
    CHECK(read_bits(evidence, owner.code(), 4).message == kReadMessage);
    CHECK(keyed_p_value(keyed_statistic(evidence, owner.code(), kReadMessage)) < 1e-4);
  }
}

TEST_CASE("informed_reader: an unmarked view is not leant to any key") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  const auto evidence = reader.evidence_at(image_of(owner, camera_near(1), false), camera_near(1));
  double power = 0;
  for (double s : evidence) power += s * s;
  CHECK(power > 0);
  const auto counts = count_wrong_keys(evidence, owner.cells.area(), kReadMessage, 20000, 5);
  double p = 1;
  for (int i = 0; i < 4; ++i)
    CHECK(counts.counts[static_cast<std::size_t>(i)] <= binomial_upper(20000, p /= 10));
  // T^2 under a wrong key has mean 1, so that it passes 1 about as often as a normal number's square does.
  Index above = 0;
  for (std::uint8_t k = 0; k < 200; ++k) {
    const double t = keyed_statistic(evidence, owner.code(test_key(k)), kReadMessage);
    above += t * t > 1;
  }
  CHECK(above > 35);
  CHECK(above < 95);
}

TEST_CASE("informed_reader: the camera is found from the image, and the reading chosen by the scene alone") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  const nerf::Camera camera = camera_near(4);
  const ImageReading marked = reader.read(image_of(owner, camera, true));
  CHECK(marked.chosen == ReadingKind::informed);
  CHECK(marked.informed.agreement > 0.95);
  CHECK(read_bits(marked.evidence(), owner.code(), 4).message == kReadMessage);
  CHECK(reader.read(image_of(owner, camera, false)).chosen == ReadingKind::informed);
  // Its evidence counts as much as the blind detection's.
  double ours = 0, theirs = 0;
  for (double s : marked.informed.evidence) ours += s * s;
  for (double s : marked.blind) theirs += s * s;
  CHECK(ours == Approx(theirs));

  const nerf::Dataset other = nerf::make_scene({.size = 96, .views = 1, .seed = 9});
  const ImageReading wrong = reader.read(other.views.front().rgba);
  CAPTURE(wrong.informed.agreement);
  CHECK(wrong.chosen == ReadingKind::blind);
  CHECK(wrong.informed.agreement < 0.8);
  CHECK(wrong.evidence() == wrong.blind);
}

TEST_CASE("informed_reader: one and two threads give the same bits") {
  const Owner owner = marking_owner();
  const Tensor<float> view_image = image_of(owner, camera_near(5), true);
  const int before = threads();
  std::vector<double> evidence[2];
  for (const int n : {1, 2}) {
    set_threads(n);
    InformedReader reader(owner, {.views = 10, .size = 32});
    evidence[n - 1] = reader.read(view_image).informed.evidence;
  }
  set_threads(before);
  CHECK(!evidence[0].empty());
  CHECK(evidence[0] == evidence[1]);
}

TEST_CASE("informed_reader: errors name what is wrong") {
  const Owner paper = tiny_paper_owner(), owner = tiny_owner();
  CHECK_THROWS_AS(InformedReader(paper), ValueError);
  InformedReader reader(owner, {.views = 1, .size = 16});
  CHECK_THROWS_AS(reader.read(Tensor<float>({15, 50, 3})), ShapeError);
  CHECK(std::string(reading_name(ReadingKind::blind)) == "blind");
  CHECK(std::string(reading_name(ReadingKind::informed)) == "informed");
}
