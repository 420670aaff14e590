#include <fieldmark/core/error.h>
#include <fieldmark/distort/distortion.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>
#include <fieldmark/watermark/reading/informed_reader.h>

#include <cmath>
#include <limits>

#include <fieldmark/watermark/reading/joint_evidence.h>
#include "evidence_view.h"
#include "pose_alignment.h"
#include "residual_signs.h"
#include "support/catch.h"
#include "watermark/cameras_apart.h"
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

Tensor<float> distorted(const char* name, const Tensor<float>& image) {
  const std::vector<float> white(3, 1.f);
  return distort::apply_distortion(distort::parse_distortion(name), image, CounterRng(1, 1), 0, white);
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
  // Under a wrong key T^2 has mean 1, so it exceeds 1 about as often as the square of a normal number does.
  Index above = 0;
  for (std::uint8_t k = 0; k < 200; ++k) {
    const double t = keyed_statistic(evidence, owner.code(test_key(k)), kReadMessage);
    above += t * t > 1;
  }
  CHECK(above > 35);
  CHECK(above < 95);
}

TEST_CASE("informed_reader: the camera of a thin object is nearer than alignment at 200 pixels leaves it") {
  const Owner owner = marking_owner();
  nerf::Camera camera = camera_near(4).scaled(320);
  camera.fx *= 0.3;  // the object is on few pixels
  camera.fy *= 0.3;
  const Tensor<float> image = distorted("noise_0.10", image_of(owner, camera, true));
  constexpr AlignmentStage kUsual[] = {{.size = 96, .blur = 1.2, .steps = 10, .quick = true},
                                       {.size = 200, .blur = 1.2, .steps = 6}};
  PoseAligner aligner(owner.field);
  const Alignment usual = aligner.align(image, camera, kUsual);
  CAPTURE(usual.agreement, usual.shown, cameras_apart(usual.camera, camera));
  REQUIRE(is_inexact(usual));
  const ImageReading reading = InformedReader(owner, kSearch).read(image);
  CHECK(reading.informed.agreement == Approx(usual.agreement).margin(0.01));
  CHECK(cameras_apart(reading.informed.camera, camera) < 0.8 * cameras_apart(usual.camera, camera));
}

TEST_CASE("informed_reader: the extractor counts only where the image has lost detail") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  const auto correlation = [](const std::vector<double>& a, const std::vector<double>& b) {
    double ab = 0, aa = 0, bb = 0;
    for (std::size_t c = 0; c < a.size(); ++c) ab += a[c] * b[c], aa += a[c] * a[c], bb += b[c] * b[c];
    return ab / std::sqrt(aa * bb);
  };
  const Tensor<float> sharp = image_of(owner, camera_near(4), true);
  const ImageReading whole = reader.read(sharp);
  CHECK(correlation(whole.informed.evidence, reader.evidence_at(sharp, whole.informed.camera)) > 0.9999);
  const Tensor<float> soft = distorted("blur_2", sharp);
  const ImageReading lost = reader.read(soft);
  const auto residual = reader.evidence_at(soft, lost.informed.camera);
  const auto joint = joint_evidence(lost.blind, residual, 2);
  REQUIRE(correlation(joint, joint_evidence(lost.blind, residual)) <
          0.9999);  // the extractor reads something
  CHECK(correlation(lost.informed.evidence, joint) > 0.9999);
}

TEST_CASE("informed_reader: evidence is taken of fewer pixels where more than 48,000 show the field") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  nerf::Renderer renderer(owner.field);
  const auto of_all_pixels = [&](const Tensor<float>& image, const ImageReading& reading) {
    const Surround seen = clear_surround(image, nerf::background_value(owner.field.background), true);
    const EvidenceView all = evidence_view(seen, reading.informed.camera, 0, owner.field.cameras);
    return scaled_to(reading.blind, residual_signs(renderer, owner, all).sign);
  };
  for (const Index size : {96, 480}) {
    const Tensor<float> image = image_of(
        owner, nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, size, 4).front(), true);
    const ImageReading reading = reader.read(image);
    REQUIRE(reading.chosen == ReadingKind::informed);
    CHECK((reading.informed.evidence == of_all_pixels(image, reading)) == (size == 96));
  }
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
  // Its evidence counts as much as that of blind detection.
  double ours = 0, theirs = 0;
  for (double s : marked.informed.evidence) ours += s * s;
  for (double s : marked.blind) theirs += s * s;
  CHECK(ours == Approx(theirs));

  const nerf::Dataset other = nerf::make_scene({.size = 96, .views = 1, .seed = 9});
  const ImageReading wrong = reader.read(other.views.front().rgba);
  CAPTURE(wrong.informed.agreement);
  CHECK(wrong.chosen == ReadingKind::blind);
  CHECK(wrong.informed.agreement < 0.83);
  CHECK(wrong.evidence() == wrong.blind);
}

TEST_CASE("informed_reader: what an image gives does not depend on those read before it") {
  const Owner owner = marking_owner();
  const CameraSearchOptions many{.views = 80, .size = 32};  // more views than the first comparison takes
  const Tensor<float> image = image_of(owner, camera_near(4), true);
  InformedReader fresh(owner, many), used(owner, many);
  const ImageReading alone = fresh.read(image);
  REQUIRE(alone.informed.agreement > 0.95);  // found among the first views
  const nerf::Dataset other = nerf::make_scene({.size = 96, .views = 1, .seed = 9});
  REQUIRE(used.read(other.views.front().rgba).informed.agreement < 0.95);  // searched among all views
  const ImageReading after = used.read(image);
  CHECK(after.informed.agreement == alone.informed.agreement);
  CHECK(after.evidence() == alone.evidence());
}

// Returns a view as others may present it: with another background behind the object, bars, a mirror.
Tensor<float> before(const Owner& owner, const nerf::Camera& camera, const std::array<float, 3>& colour) {
  nerf::Renderer renderer(owner.field);
  renderer.set_recolour(owner.marking(cell_signs(owner.code(), kReadMessage)));
  const nerf::Rendering view = renderer.render(camera);
  const float own = nerf::background_value(owner.field.background);
  Tensor<float> image = view.rgb;
  for (Index i = 0; i < image.size(); ++i)
    image[i] += (1 - view.opacity[i / 3]) * (colour[static_cast<std::size_t>(i % 3)] - own);
  return quantize8(image);
}

TEST_CASE("informed_reader: other backgrounds, bars, mirror, stretch, caption and hue do not hide the mark") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  const nerf::Camera camera = camera_near(4);
  const Index h = 96, w = 96, bar = 30;
  const Tensor<float> view = image_of(owner, camera, true);
  REQUIRE(view.shape == Shape{h, w, 3});
  Tensor<float> barred({h, w + 2 * bar, 3}, 0.f), mirrored(view.shape);
  for (Index y = 0; y < h; ++y) {
    std::copy_n(&view[3 * y * w], 3 * w, &barred[3 * (y * (w + 2 * bar) + bar)]);
    for (Index x = 0; x < w; ++x) std::copy_n(&view[3 * (y * w + x)], 3, &mirrored[3 * (y * w + w - 1 - x)]);
  }
  for (const auto& [name, image] : {std::pair{"black", before(owner, camera, {0, 0, 0})},
                                    {"green", before(owner, camera, {0.1f, 0.8f, 0.2f})},
                                    {"bars", barred},
                                    {"stretch", distorted("stretch_1.5", view)},
                                    {"caption", distorted("caption", view)},
                                    {"hue", distorted("hue_180", view)},
                                    {"mirror", mirrored}}) {
    CAPTURE(name);
    const ImageReading reading = reader.read(image);
    CAPTURE(reading.informed.agreement);
    CHECK(reading.chosen == ReadingKind::informed);
    CHECK(reading.mirrored == (std::string(name) == "mirror"));
    CHECK(read_bits(reading.evidence(), owner.code(), 4).message == kReadMessage);
    // A caption over the middle of a view hides most of its cells.
    const double most = std::string(name) == "caption" ? 0.1 : 1e-4;
    CHECK(keyed_p_value(keyed_statistic(reading.evidence(), owner.code(), kReadMessage)) < most);
  }
}

TEST_CASE("informed_reader: the mark is read beside a dark band across the view") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  for (const int place : {4, 5, 6}) {
    const Tensor<float> view = image_of(owner, camera_near(place), true);
    CAPTURE(place);
    Tensor<float> barred = view;
    for (Index y = 60; y < 70; ++y)
      for (Index x = 0; x < 96; ++x)
        for (Index c = 0; c < 3; ++c) barred[3 * (96 * y + x) + c] = 0.1f;
    const ImageReading reading = reader.read(barred);
    CAPTURE(reading.informed.agreement);
    CHECK(reading.chosen == ReadingKind::informed);
    CHECK(read_bits(reading.evidence(), owner.code(), 4).message == kReadMessage);
    CHECK(keyed_p_value(keyed_statistic(reading.evidence(), owner.code(), kReadMessage)) < 1e-3);
  }
}

TEST_CASE("informed_reader: informed evidence is left empty below the least agreement asked for") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  Tensor<float> other({96, 96, 3});
  for (Index i = 0; i < other.size(); ++i) other[i] = 0.2f + 0.07f * static_cast<float>(i / 11 % 8);
  const ImageReading all = reader.read(other);
  REQUIRE(all.chosen == ReadingKind::blind);
  REQUIRE(!all.informed.evidence.empty());
  const ImageReading some = reader.read(other, InformedReader::kLeastAgreement);
  CHECK(some.informed.evidence.empty());
  CHECK(some.informed.agreement == all.informed.agreement);
  CHECK(some.blind == all.blind);
  const Tensor<float> view = image_of(owner, camera_near(4), true);
  CHECK(reader.read(view, InformedReader::kLeastAgreement).informed.evidence ==
        reader.read(view).informed.evidence);
}

TEST_CASE("informed_reader: a part is read from a guess of its camera, whatever surrounds the object") {
  const Owner owner = marking_owner();
  InformedReader reader(owner, kSearch);
  const nerf::Camera camera = camera_near(4);
  nerf::Renderer renderer(owner.field);
  const Tensor<float> opacity = renderer.render(camera).opacity;
  Tensor<float> image = image_of(owner, camera, true);
  const float level = nerf::background_value(owner.field.background);
  for (Index i = 0; i < image.size(); ++i)
    image[i] += (1 - opacity[i / 3]) * (0.3f + 0.4f * static_cast<float>(i / 3 % 96 / 12 % 2) - level);
  nerf::Camera guess = camera;
  guess.cx += 2, guess.cy -= 1, guess.fx *= 1.02, guess.fy *= 1.02;
  const ImageReading part = reader.read_near(quantize8(image), guess, 0.9);
  CHECK(part.chosen == ReadingKind::informed);
  CHECK(part.informed.agreement >= 0.9);
  CHECK(read_bits(part.evidence(), owner.code(), 4).message == kReadMessage);
  CHECK(keyed_p_value(keyed_statistic(part.evidence(), owner.code(), kReadMessage)) < 1e-4);
  // Pixels that something else covers do not count.
  std::vector<std::uint8_t> covered(96 * 96, 0);
  std::fill_n(covered.begin(), 40 * 96, std::uint8_t{1});
  const ImageReading half = reader.read_near(quantize8(image), guess, 0.5, covered);
  Tensor<float> painted = quantize8(image);
  std::fill_n(painted.data.begin(), 3 * 40 * 96, 0.f);
  const ImageReading same = reader.read_near(painted, guess, 0.5, covered);
  CHECK(half.chosen == ReadingKind::informed);
  CHECK(same.informed.agreement == Approx(half.informed.agreement).margin(0.02));
  const ImageReading none = reader.read_near(quantize8(image), camera_near(7), 0.9);
  CHECK(none.chosen == ReadingKind::blind);
  CHECK(none.informed.agreement < 0.9);
  CHECK(none.informed.evidence.empty());
  CHECK(none.blind.empty());
}

TEST_CASE("informed_reader: one and two threads give the same bits") {
  const Owner owner = marking_owner();
  const Tensor<float> view_image = image_of(owner, camera_near(5), true);
  InformedReading found[2];
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    InformedReader reader(owner, {.views = 10, .size = 32});
    found[n - 1] = reader.read(view_image).informed;
  }
  CHECK(!found[0].evidence.empty());
  CHECK(found[0].evidence == found[1].evidence);
  CHECK(found[0].agreement == found[1].agreement);
  CHECK(found[0].camera.pose == found[1].camera.pose);
}

TEST_CASE("informed_reader: errors name what is wrong") {
  const Owner paper = tiny_paper_owner(), owner = tiny_owner();
  CHECK_THROWS_AS(InformedReader(paper), ValueError);
  InformedReader reader(owner, {.views = 1, .size = 16});
  CHECK_THROWS_AS(reader.read(Tensor<float>({15, 50, 3})), ShapeError);
  CHECK_THROWS_WITH(
      reader.evidence_at(Tensor<float>({20, 30, 3}), camera_near(1)),
      "[informed_reader] image must be of the camera's size, [96, 96, 3], got shape [20, 30, 3]");
  const Tensor<float> infinite({96, 96, 3}, std::numeric_limits<float>::infinity());
  CHECK_THROWS_WITH(reader.evidence_at(infinite, camera_near(1)),
                    "[informed_reader] image must be finite, got inf in row 0, column 0");
  CHECK_THROWS_WITH(reader.read_near(infinite, camera_near(1), 0.5),
                    "[informed_reader] image must be finite, got inf in row 0, column 0");
  CHECK_THROWS_WITH(reader.read_near(Tensor<float>({8, 8, 3}), camera_near(1).scaled(8), 0.5),
                    "[informed_reader] image must have sides of at least 16, got shape [8, 8, 3]");
  CHECK_THROWS_WITH(reader.read_near(Tensor<float>({96, 96, 3}), camera_near(1), 0.5, {1, 1}),
                    "[informed_reader] covered must have the image's 9216 pixels, got 2");
  CHECK(std::string(reading_name(ReadingKind::blind)) == "blind");
  CHECK(std::string(reading_name(ReadingKind::informed)) == "informed");
}
