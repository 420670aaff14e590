#include <fieldmark/core/error.h>
#include <fieldmark/nerf/exposure_trial.h>

#include "nerf/objects_scene.h"
#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
Dataset darkened(float every_other) {
  Dataset data = objects_scene();
  for (std::size_t v = 0; v < data.views.size(); v += 2)
    for (Index i = 0; i < data.views[v].rgba.size(); ++i)
      if (i % 4 != 3) data.views[v].rgba[i] *= every_other;
  return data;
}
Dataset held_out() { return make_scene({.size = 24, .views = 2}, "test"); }
}  // namespace

TEST_CASE("exposure_trial: exposures are taken where images are mixed, and not where all are alike") {
  const ExposureTrialOptions options{.steps = 96, .samples_per_step = 4096};
  Index calls = 0, last = 0;
  const auto mixed = try_exposures(darkened(0.6f), held_out(), trainable_field_options(), options,
                                   [&](Index done, Index total) {
                                     ++calls;
                                     CHECK(done > last);
                                     CHECK(total == 192);
                                     last = done;
                                     return true;
                                   });
  REQUIRE(mixed);
  CAPTURE(mixed->psnr_without, mixed->psnr_with, mixed->spread);
  CHECK(mixed->helps);
  CHECK(mixed->psnr_with > mixed->psnr_without + 0.1);
  CHECK(calls == 12);
  CHECK(last == 192);
  const auto alike = try_exposures(objects_scene(), held_out(), trainable_field_options(), options);
  REQUIRE(alike);
  CAPTURE(alike->psnr_without, alike->psnr_with, alike->spread);
  CHECK(mixed->spread > 2 * alike->spread);
  CHECK_FALSE(alike->helps);
}

TEST_CASE("exposure_trial: stops when asked, and refuses too few steps") {
  const auto stopped = try_exposures(objects_scene(), held_out(), trainable_field_options(), {.steps = 64},
                                     [](Index, Index) { return false; });
  CHECK_FALSE(stopped);
  CHECK_THROWS_WITH(try_exposures(objects_scene(), held_out(), trainable_field_options(), {.steps = 63}),
                    "[exposure_trial] steps must be at least 64, got 63");
}
