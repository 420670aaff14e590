#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/watermark/attacks/attack_meter.h>
#include <fieldmark/watermark/attacks/field_attack.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

const Message kMeteredMessage{{1, 0, 1}};

AttackMeterOptions options(Index views, const Owner& owner) {
  return {.cameras = nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, views, 32, 3),
          .group = 2,
          .seed = 5};
}

struct Images {
  std::vector<Tensor<float>> rgb, opacity;
};
Images render(const nerf::RadianceField& field, const AttackMeterOptions& o) {
  nerf::Renderer renderer(field);
  Images p;
  for (const auto& camera : o.cameras) {
    auto r = renderer.render(camera);
    p.rgb.push_back(quantize8(r.rgb));
    p.opacity.push_back(r.opacity);
  }
  return p;
}

// Checks a row against the values that the reader and the evidence alone give for these images.
void check_row(const AttackRow& row, const Owner& owner, const std::vector<Tensor<float>>& images) {
  const BlindReader reader(owner);
  double accuracy = 0;
  std::vector<double> p;
  for (std::size_t i = 0; i < images.size(); i += 2) {
    auto sum = reader.evidence(images[i]);
    const auto second = reader.evidence(images[i + 1]);
    for (const auto& e : {sum, second})
      accuracy += match_bits(read_bits(e, owner.code(), 3), kMeteredMessage).accuracy();
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += second[c];
    p.push_back(keyed_p_value(keyed_statistic(sum, owner.code(), kMeteredMessage)));
  }
  CHECK(row.accuracy.blind == Approx(accuracy / static_cast<double>(images.size())));
  CHECK((std::isnan(row.accuracy.informed) && row.chosen() == row.accuracy.blind));
  std::sort(p.begin(), p.end());
  REQUIRE(p.size() == 3);
  CHECK(row.p_value == Approx(p[1]));
}

}  // namespace

TEST_CASE("attack_meter: rows are what reader, evidence and PSNR say of the same images") {
  const Owner owner = small_owner();
  const nerf::RadianceField marked = watermark::apply_field_attack(
      watermark::parse_field_attack("weights_noise_0.1"), owner.field, CounterRng(1));
  const auto o = options(6, owner);
  const AttackMeter meter(owner, marked, kMeteredMessage, o);
  const Images before = render(marked, o);

  const AttackRow none = meter.none();
  CHECK(none.name == "none");
  CHECK(none.kept == 1);
  CHECK(std::isnan(none.psnr_foreground));
  check_row(none, owner, before.rgb);

  const float white[3] = {1, 1, 1};
  double damage = 0;
  std::vector<Tensor<float>> after;
  for (std::size_t i = 0; i < 6; ++i) {
    after.push_back(distort::apply_distortion(distort::parse_distortion("jpeg_40"), before.rgb[i],
                                              CounterRng(5, 42), i, white));
    damage += psnr_masked(after.back(), before.rgb[i], before.opacity[i]) / 6;
  }
  const AttackRow jpeg = meter.image("jpeg_40");
  CHECK(jpeg.psnr_foreground == Approx(damage));
  CHECK(jpeg.kept == 1);
  check_row(jpeg, owner, after);

  const auto attacked =
      watermark::apply_field_attack(watermark::parse_field_attack("greyscale"), marked, CounterRng(1));
  const Images grey = render(attacked, o);
  const AttackRow field = meter.field("greyscale", attacked);
  check_row(field, owner, grey.rgb);
  double against_marked = 0, against_base = 0;
  const Images base = render(owner.field, o);
  for (std::size_t i = 0; i < 6; ++i) {
    against_marked += psnr_masked(grey.rgb[i], before.rgb[i], before.opacity[i]) / 6;
    against_base += psnr_masked(grey.rgb[i], base.rgb[i], base.opacity[i]) / 6;
  }
  CHECK(field.psnr_foreground == Approx(against_marked));
  CHECK(meter.field("x", attacked, &owner.field).psnr_foreground == Approx(against_base));
}

TEST_CASE("attack_meter: an attack that only moves pixels does no damage but to what it cuts off") {
  const Owner owner = small_owner();
  const auto o = options(4, owner);
  const AttackMeter meter(owner, owner.field, kMeteredMessage, o);
  const AttackRow crop = meter.image("crop_0.5");
  CHECK(std::isnan(crop.psnr_foreground));
  CHECK((crop.kept > 0.2 && crop.kept < 1));
  // Nearest neighbours at twice the size, then bilinear at the old positions: each new pixel keeps its old
  // colour.
  const AttackRow larger = meter.image("scale-nearest_2");
  CHECK(larger.kept == 1);
  CHECK(std::isnan(larger.psnr_foreground));  // no pixel differs
  const Tensor<float> seen = quantize8(uniform<float>({12, 16, 3}, 0, 1, 1));
  const float white[3] = {1, 1, 1};
  distort::PixelMap source;
  const auto after = distort::apply_distortion(distort::parse_distortion("scale-nearest_2"), seen,
                                               CounterRng(5, 42), 0, white, &source);
  CHECK(attack_damage(seen, Tensor<float>({12, 16}, 1), after, source).psnr > 100);
  const AttackRow turned = meter.image("rotation_20"), blurred = meter.image("rotation_20,blur_3");
  CHECK(turned.kept > 0.7);
  CHECK(blurred.psnr_foreground < turned.psnr_foreground - 3);
  const AttackRow unreadable = meter.image("scale_0.2");
  CHECK(unreadable.accuracy.blind == 0.5);
  CHECK(unreadable.p_value == 1);
}

TEST_CASE("attack_meter: damage is of the object's pixels that still show, where they went") {
  Tensor<float> before({4, 6, 3}), opacity({4, 6});
  for (Index i = 0; i < before.size(); ++i) before[i] = static_cast<float>(i % 17) / 17;
  for (Index p = 0; p < 24; ++p) opacity[p] = p % 6 < 3 ? 1.f : 0.5f;
  // Columns 1 to 4 remain, all a tenth brighter: columns 1 and 2 of the object's 0 to 2.
  Tensor<float> after({4, 4, 3});
  for (Index y = 0; y < 4; ++y)
    for (Index i = 0; i < 12; ++i) after[12 * y + i] = before[18 * y + 3 + i] + 0.1f;
  const AttackDamage damage = attack_damage(before, opacity, after, {{1, 0, 1, 0, 1, 0}});
  CHECK(damage.kept == Approx(2.0 / 3));
  CHECK(damage.psnr == Approx(20).epsilon(1e-5));
  // Turned by a right angle about the centre: x' = y, y' = 5 - x for an image of 4 x 6.
  Tensor<float> turned({6, 4, 3});
  for (Index y = 0; y < 6; ++y)
    for (Index x = 0; x < 4; ++x)
      for (Index c = 0; c < 3; ++c) turned[3 * (4 * y + x) + c] = before[3 * (6 * x + (5 - y)) + c];
  const AttackDamage none = attack_damage(before, opacity, turned, {{0, -1, 5, 1, 0, 0}});
  CHECK(none.psnr > 200);
  CHECK(none.kept == 1);
  // A part: of column 1 alone, whatever stands where the others would be.
  distort::PixelMap part{{1, 0, 1, 0, 1, 0}};
  part.kept = {0.5, -0.5, 1.5, 3.5};
  const AttackDamage one = attack_damage(before, opacity, after, part);
  CHECK(one.kept == Approx(1.0 / 3));
  CHECK(one.psnr == Approx(20).epsilon(1e-5));
  const Tensor<float> nothing({4, 6});
  CHECK(std::isnan(attack_damage(before, nothing, after, {}).psnr));
  CHECK(std::isnan(attack_damage(before, nothing, after, {}).kept));
  CHECK_THROWS_WITH(attack_damage(before, Tensor<float>({4, 5}), after, {}),
                    "[attack_damage] opacity must have a number for each pixel of before, [4, 6, 3], got "
                    "shape [4, 5]");
}

TEST_CASE("attack_meter: of the first views informed is read too, as the tool would choose") {
  const Owner owner = small_owner();
  auto o = options(2, owner);
  CHECK(AttackMeter(owner, owner.field, kMeteredMessage, o).informed_views() == 0);
  o.informed_views = 1;
  const AttackMeter meter(owner, owner.field, kMeteredMessage, o);
  CHECK(meter.informed_views() == 1);
  InformedReader reader(owner);
  const auto share = [&](const std::vector<double>& evidence) {
    return evidence.empty() ? 0.5
                            : match_bits(read_bits(evidence, owner.code(), 3), kMeteredMessage).accuracy();
  };
  const float white[3] = {1, 1, 1};
  const Tensor<float> first = render(owner.field, o).rgb[0];
  for (const char* name : {"", "rotation_20"}) {
    CAPTURE(name);
    const AttackRow row = *name ? meter.image(name) : meter.none();
    const ImageReading read = reader.read(
        *name ? distort::apply_distortion(distort::parse_distortion(name), first, CounterRng(5, 42), 0, white)
              : first);
    CHECK(row.accuracy.informed == share(read.informed.evidence));
    CHECK(row.accuracy.chosen == share(read.evidence()));
    CHECK(row.chosen() == row.accuracy.chosen);
    const double p = keyed_p_value(keyed_statistic(read.evidence(), owner.code(), kMeteredMessage));
    CHECK(row.accuracy.found == (p <= 1e-6 ? 1 : 0));
  }
  const AttackRow unreadable = meter.image("scale_0.2");
  CHECK((unreadable.accuracy.informed == 0.5 && unreadable.chosen() == 0.5));
  CHECK(unreadable.accuracy.found == 0);
  o.informed_views = -1;
  CHECK_THROWS_WITH(AttackMeter(owner, owner.field, kMeteredMessage, o),
                    "[attack_meter] informed_views must not be negative, got -1");
}

TEST_CASE("attack_meter: errors, progress and threads") {
  const Owner owner = small_owner();
  auto o = options(2, owner);
  CHECK_THROWS_WITH(AttackMeter(owner, owner.field, Message{{1}}, o),
                    "[attack_meter] message must have the owner's 3 bits, got 1");
  CHECK_THROWS_WITH(AttackMeter(owner, owner.field, kMeteredMessage, {}),
                    "[attack_meter] cameras must not be empty");
  AttackMeterOptions no_group = o;
  no_group.group = 0;
  CHECK_THROWS_WITH(AttackMeter(owner, owner.field, kMeteredMessage, no_group),
                    "[attack_meter] group must be at least 1, got 0");
  Index seen = 0;
  o.progress = [&](Index done, Index total) {
    CHECK(total == 2);
    seen += done;
    return true;
  };
  const AttackMeter meter(owner, owner.field, kMeteredMessage, o);
  CHECK(seen == 3);
  CHECK_THROWS_AS(meter.image("sharpen_1"), ValueError);
  const ScopedThreads serial(1);
  const AttackRow one = meter.image("combined");
  const ScopedThreads parallel(2);
  const AttackRow two = meter.image("combined");
  CHECK((one.psnr_foreground == two.psnr_foreground && one.p_value == two.p_value && one.kept == two.kept));
  AttackMeterOptions stop = options(2, owner);
  stop.progress = [](Index, Index) { return false; };
  CHECK_THROWS_WITH(AttackMeter(owner, owner.field, kMeteredMessage, stop),
                    "stopped while measuring attacks");
}
