#include "bake_plan.h"

#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("bake_plan: objects take more rays and larger steps, and levels of the table one range each") {
  const nerf::RadianceField& object = small_field();
  REQUIRE(is_object_of_hash(object));
  nerf::RadianceField scene = object;
  scene.space.kind = nerf::SpaceKind::contracted;
  CHECK(!is_object_of_hash(scene));
  const BakePlan of_object = bake_plan(object), of_scene = bake_plan(scene);
  CHECK(of_object.chunks > of_scene.chunks);
  const auto levels = static_cast<std::size_t>(object.field.encoding().levels());
  REQUIRE(of_object.ranges.size() == 1 + levels);
  REQUIRE(of_scene.ranges.size() == 1 + levels);
  for (std::size_t i = 0; i <= levels; ++i) {
    CHECK(of_object.ranges[i].lr_factor == 5 * of_scene.ranges[i].lr_factor);
    CHECK(of_object.ranges[i].begin == of_scene.ranges[i].begin);
    CHECK(of_object.ranges[i].skip_zero == (i > 0));
  }
}

TEST_CASE(
    "bake_plan: the ranges hold every parameter of colour networks and table, and none of the density's") {
  const nerf::RadianceField& field = small_field();
  const BakePlan plan = bake_plan(field);
  for (const auto& e : field.params.entries()) {
    const bool table = e.offset >= field.field.network_size();
    bool within = false;
    for (const AdamRange& range : plan.ranges)
      within |= !table && e.offset >= range.begin && e.offset + e.shape.size() <= range.end;
    CAPTURE(e.name);
    if (!table) CHECK(within == nerf::Field<float>::is_colour(e.name));
  }
  for (std::size_t i = 2; i < plan.ranges.size(); ++i) CHECK(plan.ranges[i].begin == plan.ranges[i - 1].end);
  CHECK(plan.ranges[1].begin == field.field.network_size());
  CHECK(plan.ranges.back().end == field.params.size());
  const nerf::RadianceField mlp(small_mlp_options());
  CHECK(bake_plan(mlp).ranges.size() == 1);
}
