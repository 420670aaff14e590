#include <fieldmark/distort/distortion.h>
#include <fieldmark/watermark/attacks/attack_curves.h>
#include <fieldmark/watermark/attacks/field_attack.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("attack_curves: each name is that of an attack, and no curve is empty") {
  CHECK(watermark::image_attack_curves().size() > 20);
  for (const auto& curve : watermark::image_attack_curves()) {
    CHECK(!curve.empty());
    for (const auto& name : curve) CHECK_NOTHROW(distort::parse_distortion(name));
  }
  auto curves = watermark::field_attack_curves();
  CHECK(curves.size() > 9);
  curves.push_back(watermark::average_attack_curve());
  curves.push_back(watermark::copy_attack_curve());
  for (const auto& curve : curves) {
    CHECK(!curve.empty());
    for (const auto& name : curve) CHECK_NOTHROW(watermark::parse_field_attack(name));
  }
}
