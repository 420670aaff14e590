#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/psnr_target.h>

#include "small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

TEST_CASE("psnr_target: without held-out views the training rays count") {
  const RadianceField field = small_field();
  PsnrTarget target(field, 20, std::nullopt), off(field, 0, std::nullopt);
  CHECK_FALSE(target.reached(1, 19.9));
  CHECK(target.reached(1, 20));
  CHECK_FALSE(off.reached(1, 99));
}

TEST_CASE("psnr_target: the first held-out views count, once every 250 steps") {
  const RadianceField field = small_field();
  Dataset data = make_scene({.kind = SceneKind::sphere, .size = 16, .views = 5});
  Dataset few = data;
  few.views.resize(PsnrTarget::kViews);
  Renderer renderer(field);
  const double psnr = evaluate(renderer, few).psnr;
  PsnrTarget below(field, psnr - 1e-6, data), above(field, psnr + 1e-6, data);
  CHECK_FALSE(below.reached(0, 99));
  CHECK_FALSE(below.reached(249, 99));
  CHECK(below.reached(250, 0));
  CHECK_FALSE(below.reached(250, 0));  // already evaluated
  CHECK(below.reached(500, 0));
  CHECK_FALSE(above.reached(250, 99));
}
