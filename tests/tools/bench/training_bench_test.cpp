#include <fieldmark/core/error.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/tools/bench/training_bench.h>

#include <set>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("training_bench: every variant but the first differs from the default in its own choice") {
  const auto all = training_variants({.steps = 40}, 5);
  REQUIRE(all.size() > 10);
  std::set<std::string> names, choices;
  for (const TrainingVariant& v : all) {
    CAPTURE(v.choice, v.setting);
    CHECK(names.insert(v.choice + v.setting).second);
    choices.insert(v.choice);
    CHECK(v.train.seed == 5);
    CHECK(v.train.schedule.steps == 40);
    const auto& d = all.front();
    const int differs =
        (v.train.first_samples != d.train.first_samples ||
         v.train.samples_per_step != d.train.samples_per_step) +
        (v.train.schedule.lr != d.train.schedule.lr || v.train.schedule.last != d.train.schedule.last ||
         v.train.schedule.half_after != d.train.schedule.half_after) +
        (v.train.hard_pixels != d.train.hard_pixels) + (v.train.distortion != d.train.distortion) +
        (v.field.supersampling != d.field.supersampling) +
        (v.train.table_decay != d.train.table_decay || v.train.decay_after != d.train.decay_after) +
        (v.train.huber != d.train.huber) + (v.train.stop != d.train.stop) + (v.train.carve != d.train.carve) +
        (v.field.field.width != d.field.field.width ||
         v.field.field.encoding.log2_table != d.field.field.encoding.log2_table);
    CHECK(differs == (&v == all.data() ? 0 : 1));
  }
  CHECK(choices.size() == 11);
}

TEST_CASE("training_bench: a longer training is better, and what was done is told") {
  const nerf::Dataset train = nerf::make_scene({.size = 32, .views = 10}),
                      judge = nerf::make_scene({.size = 32, .views = 2}, "val");
  std::vector<TrainingVariant> two(2, training_variants({.steps = 60}, 1).front());
  for (TrainingVariant& v : two) {
    v.field.field.encoding.log2_table = 12;
    v.field.occupancy = 32;
    v.train.samples_per_step = v.train.first_samples = 2048;
  }
  two[0].train.schedule.steps = 5;
  double done = -1;
  const auto rows = run_training_bench(train, judge, two, [&](const std::string& name, double part) {
    CHECK(name == "default: as trained");
    CHECK(part >= done);
    done = part;
  });
  REQUIRE(rows.size() == 2);
  CHECK(rows[0].steps == 5);
  CHECK(rows[1].steps == 60);
  CHECK(rows[1].samples > 5 * rows[0].samples);
  CHECK(rows[1].psnr > rows[0].psnr + 3);
  CHECK(rows[1].seconds > 0);
  CHECK(rows[1].seconds_per_view > 0);
}

TEST_CASE("training_bench: it can be stopped, and bad options are named") {
  const nerf::Dataset train = nerf::make_scene({.size = 16, .views = 2});
  auto one = training_variants({.steps = 5}, 1);
  one.resize(1);
  const auto stop = [](const std::string&, double) { throw ValueError("stop"); };
  CHECK_THROWS_WITH(run_training_bench(train, train, one, stop), "stop");
  one.front().train.stop = 2;
  CHECK_THROWS_WITH(run_training_bench(train, train, one), Contains("[trainer] stop must be in [0, 1)"));
}
