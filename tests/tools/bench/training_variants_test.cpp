#include <fieldmark/tools/bench/training_variants.h>

#include <set>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("training_variants: every variant but the first differs from the default in its own choice") {
  const auto all = training_variants({.steps = 40}, 5);
  REQUIRE(all.size() > 10);
  std::set<std::string> names, choices;
  for (const TrainingVariant& v : all) {
    CAPTURE(v.choice, v.setting);
    CHECK(names.insert(v.name()).second);
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

TEST_CASE("training_variants: ordinary trainings differ and have the length and the seed") {
  std::set<std::string> names;
  const auto all = ordinary_trainings({.seconds = 3}, 7);
  for (const TrainingVariant& v : all) {
    CAPTURE(v.name());
    CHECK(names.insert(v.name()).second);
    CHECK(v.field.seed == 7);
    CHECK(v.train.seed == 7);
    CHECK(v.train.schedule.seconds == 3);
  }
  CHECK(all.size() == training_variants({.seconds = 3}, 7).size() + 4);
  CHECK(all[0].name() == "default: as trained");
  CHECK(all[1].field.field.kind == nerf::FieldKind::mlp);
  CHECK(all[2].train.image_colours);
  CHECK(all[3].train.refine_poses);
  CHECK(all[4].field.field.encoding.log2_table == 12);
}
