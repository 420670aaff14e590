#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/collapse_watch.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "nerf/objects_scene.h"
#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
// Returns a field trained on the scene for some steps.
RadianceField trained(Index steps) {
  RadianceField field(trainable_field_options());
  Trainer trainer(field, objects_scene(),
                  {.schedule = {.steps = steps}, .samples_per_step = 8192, .warm_up = 16});
  while (!trainer.done()) trainer.step(0);
  return field;
}

// Marks all cells but the first `cells_left` as empty, so that rays end in the background.
RadianceField emptied(RadianceField field, Index cells_left) {
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(field.grid.cells()));
  std::fill_n(bits.begin(), cells_left, 1);
  field.grid.set_bits(bits);
  return field;
}
}  // namespace

TEST_CASE("collapse_watch: a field that learns passes, and is not touched") {
  const RadianceField field = trained(60);
  const std::vector<float> values(field.params.values().begin(), field.params.values().end());
  const std::vector<std::uint8_t> bits(field.grid.bits().begin(), field.grid.bits().end());
  CollapseWatch watch(field, objects_scene());
  CHECK(watch.explained() > 0.6);
  CHECK(watch.explained() <= 1);
  for (Index steps = 0; steps <= 4096; ++steps)
    if (steps % 128 == 0 || steps % 100 == 0) CHECK(watch.look(steps, 20, 0) == "");
  CHECK(watch.verdict(4096) == "");
  CHECK(std::ranges::equal(field.params.values(), values));
  CHECK(std::ranges::equal(field.grid.bits(), bits));
}

TEST_CASE("collapse_watch: views of one colour are noticed at the third look, and at the end of a run") {
  const RadianceField white = emptied(trained(1), 1);
  CollapseWatch watch(white, objects_scene());
  CHECK(watch.explained() < 0);
  CHECK(watch.look(128, 9, 0) == "");
  CHECK(watch.look(128, 9, 0) == "");
  CHECK(watch.look(200, 9, 0) == "");
  CHECK(watch.look(256, 9, 0) == "");
  CHECK_THAT(watch.look(384, 9, 0), Contains("the mean square error of rendered views is ") &&
                                        Contains(" times that of a constant image"));
  CHECK(watch.verdict(383) == "");
  CHECK(watch.verdict(384) != "");
}

TEST_CASE("collapse_watch: slow steps are looked at after seconds, but not before a field can have learnt") {
  const RadianceField white = emptied(trained(1), 1);
  CollapseWatch slow(white, objects_scene());
  CHECK(slow.look(0, 9, 100) == "");
  CHECK(slow.look(23, 9, 110) == "");  // too few steps for a look
  CHECK(slow.look(24, 9, 110) == "");
  CHECK(slow.look(60, 9, 111) == "");  // too soon
  CHECK(slow.look(61, 9, 111.5) == "");
  CHECK_THAT(slow.look(85, 9, 113), Contains("times that of a constant image"));
  const RadianceField empty = emptied(trained(1), 0);
  CollapseWatch none(empty, objects_scene());
  CHECK(none.look(1, 9, 0) == "");
  CHECK(none.look(25, 9, 3) == "no cell of the scene is occupied");
}

TEST_CASE("collapse_watch: no cells and a loss that is no number are noticed at once") {
  const RadianceField none = emptied(trained(1), 0), some = trained(1);
  CHECK(CollapseWatch(none, objects_scene()).look(0, 0, 0) == "no cell of the scene is occupied");
  CHECK(CollapseWatch(none, objects_scene()).look(128, 20, 0) == "no cell of the scene is occupied");
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(CollapseWatch(some, objects_scene()).look(7, nan, 0) == "the loss is not a number");
  CHECK(CollapseWatch(some, objects_scene()).look(0, nan, 0) == "");
}

TEST_CASE("collapse_watch: images of one colour tell nothing about a field") {
  Dataset flat = objects_scene();
  for (View& v : flat.views) std::ranges::fill(v.rgba.data, 1.f);
  const RadianceField field = trained(1);
  CollapseWatch watch(field, flat);
  for (const Index steps : {128, 256, 384, 512}) CHECK(watch.look(steps, 9, 0) == "");
  CHECK(watch.verdict(512) == "");
}
