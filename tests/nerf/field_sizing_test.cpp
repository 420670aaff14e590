#include <fieldmark/core/error.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/field_sizing.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
const SizingOptions kShort{.steps = 64, .samples_per_step = 2048, .most_log2_table = 13, .seed = 3};
const Dataset& sphere() {
  static const Dataset data = make_scene({.kind = SceneKind::sphere, .size = 32, .views = 8});
  return data;
}
}  // namespace

TEST_CASE("field_sizing: pixels by hand") {
  Dataset data;
  for (const double distance : {3., 4., 5.}) {
    View v{.camera =
               make_camera(look_at({distance + 1, 2, 3}, {1, 2, 3}, {0, 0, 1}), 2 * std::atan(0.5), 100, 80),
           .rgba = {},
           .name = {}};
    data.views.push_back(v);  // fx = 100
  }
  const Bounds bounds{.corner = {0, 1, 2}, .side = 2};
  CHECK(pixel_resolution(data, {.bounds = bounds}) == Approx(2 * 100 / 4.));
  CHECK(pixel_resolution(data, {.kind = SpaceKind::contracted, .bounds = bounds}) == Approx(400));
  CHECK(pixel_resolution(data, {.kind = SpaceKind::ndc, .near = 1, .slope_x = 0.25, .slope_y = 1}) ==
        Approx(400));
}

TEST_CASE("field_sizing: tries tables, direction, width and levels, and keeps what its figures say") {
  RadianceFieldOptions start;
  start.step = 1.f / 100;
  const FieldSizing sizing = size_field(sphere(), start, kShort);
  REQUIRE(sizing.trials.size() >= 3);
  CHECK(sizing.compared);
  CHECK(sizing.trials[0].kept);
  double psnr = 0;
  for (const SizingTrial& t : sizing.trials) {
    CAPTURE(t.what, t.psnr);
    CHECK(t.psnr > 5);
    CHECK(t.parameters > 0);
    const bool table = t.what.starts_with("table"), direction = t.what.starts_with("no viewing");
    const double loss = direction                           ? -kShort.worth / 6
                        : t.what.starts_with("networks of") ? kShort.worth / 6
                                                            : kShort.worth / 2;
    const double least = psnr - loss;
    CHECK(t.kept ==
          (table ? psnr == 0 || t.psnr >= psnr + kShort.worth : t.psnr >= std::min(least, kShort.enough)));
    if (t.kept) psnr = t.psnr;
  }
  CHECK(sizing.field.step == start.step);
  CHECK(sizing.field.field.encoding.finest_resolution <= std::floor(1.5 * sizing.pixels));
  CHECK(RadianceField(sizing.field).params.size() < RadianceField(start).params.size());
}

TEST_CASE("field_sizing: the same for the same seed, and ends when told to") {
  const FieldSizing a = size_field(sphere(), {}, kShort), b = size_field(sphere(), {}, kShort);
  REQUIRE(a.trials.size() == b.trials.size());
  for (std::size_t i = 0; i < a.trials.size(); ++i) CHECK(a.trials[i].psnr == b.trials[i].psnr);
  Index last = 0;
  const FieldSizing cut = size_field(sphere(), {}, kShort, [&](Index done, Index total) {
    CHECK(done >= last);
    CHECK(total > done);
    last = done;
    return done < 2;
  });
  CHECK(cut.trials.size() == 2);
  CHECK(!cut.compared);
  for (const SizingTrial& t : cut.trials) CHECK(!t.kept);
}

TEST_CASE("field_sizing: ended before tables have been compared, the field is as it was") {
  Index asked = 0;
  const FieldSizing cut = size_field(sphere(), {}, kShort, [&](Index, Index) { return ++asked < 3; });
  CHECK(cut.trials.empty());
  CHECK(asked == 3);  // before the first training, and twice within it
  CHECK(!cut.compared);
  CHECK(cut.pixels > 0);
  CHECK(cut.field.seed == kShort.seed);
  CHECK(RadianceField(cut.field).configuration() == RadianceField(RadianceFieldOptions{}).configuration());
}

TEST_CASE("field_sizing: without bounds, what is empty is found once, not by each training") {
  Dataset images = sphere();
  images.scene = SceneType::place;
  for (View& v : images.views)
    for (Index i = 3; i < v.rgba.size(); i += 4) v.rgba[i] = 1;
  const FieldSizing sizing = size_field(images, {}, kShort);
  REQUIRE(sizing.compared);
  RadianceField alone(sizing.trials[0].field);
  Trainer trainer(alone, images,
                  {.schedule = {.steps = kShort.steps},
                   .samples_per_step = kShort.samples_per_step,
                   .least_rays = 128,
                   .seed = kShort.seed});
  REQUIRE(alone.space.kind == SpaceKind::contracted);
  while (!trainer.done()) trainer.step(0);
  CAPTURE(trainer.samples(), sizing.trials[0].samples);
  CHECK(sizing.trials[0].samples > 0);
  CHECK(sizing.trials[0].samples < 0.6 * trainer.samples());
}

TEST_CASE("field_sizing: options out of range") {
  RadianceFieldOptions mlp;
  mlp.field.kind = FieldKind::mlp;
  CHECK_THROWS_WITH(size_field(sphere(), mlp, kShort), Contains("[size_field] start must be a hash field"));
  for (const SizingOptions& wrong :
       {SizingOptions{.steps = 10}, SizingOptions{.worth = 0}, SizingOptions{.most_log2_table = 8}})
    CHECK_THROWS_WITH(size_field(sphere(), {}, wrong),
                      Contains("[size_field] options must have at least 64 steps"));
}

TEST_CASE(
    "field_sizing: a field without directions looks the same from everywhere, and comes back from a file") {
  RadianceFieldOptions options;
  options.field.encoding = {.levels = 3, .log2_table = 8, .base_resolution = 4, .finest_resolution = 16};
  options.field.directional = false;
  RadianceField f(options);
  f.cameras = camera_span(sphere());
  CHECK(f.field.direction_width() == 0);
  Tape<float> tape;
  const float x[] = {0.3f, 0.6f, 0.1f, 0.3f, 0.6f, 0.1f}, d[] = {1, 0, 0, 0, 0.6f, 0.8f};
  const auto out =
      f.field(Params<float>(f.params, nullptr), tape.constant(x, {2, 3}), tape.constant(d, {2, 3}));
  for (Index k = 0; k < 3; ++k) CHECK(out.rgb.value()[k] == out.rgb.value()[3 + k]);
  CHECK_FALSE(RadianceField::from_configuration(f.configuration(), "here").options().field.directional);
}

TEST_CASE("field_sizing: fit_field takes the largest table whose file fits") {
  const RadianceFieldOptions start{.field = {.encoding = {.levels = 4, .log2_table = 14}}, .occupancy = 32};
  const auto fit = fit_field(start, 200e3);
  REQUIRE(fit);
  const auto bytes = [](const RadianceFieldOptions& o) { return 4 * RadianceField(o).params.size(); };
  CHECK(bytes(*fit) < 200e3 - 32e3);
  RadianceFieldOptions larger = *fit;
  ++larger.field.encoding.log2_table;
  CHECK(bytes(larger) + 32 * 32 * 32 / 8 + 32e3 > 200e3);
  CHECK(fit_field(start, 1e9)->field.encoding.log2_table == 14);
  CHECK_FALSE(fit_field(start, 33e3));
}
