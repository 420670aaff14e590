#include <fieldmark/core/error.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/tools/bench/training_bench.h>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

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
