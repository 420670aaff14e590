#include "training_loop.h"

#include <vector>

#include "nerf/objects_scene.h"
#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("training_loop: the share done is of the steps if there are any, else of the seconds") {
  CHECK(part_done({.steps = 40, .seconds = 1}, 10, 0.9) == 0.25);
  CHECK(part_done({.seconds = 4}, 10, 1) == 0.25);
  CHECK(part_done({.seconds = 4}, 10, 5) == 1);
}

TEST_CASE("training_loop: a training goes to its last step and tells the share done before each") {
  const ScheduleOptions schedule{.steps = 4};
  nerf::RadianceField field(trainable_field_options());
  nerf::Trainer trainer(field, objects_scene(),
                        {.schedule = schedule, .samples_per_step = 1024, .first_samples = 1024});
  std::vector<double> parts;
  train_to_end(trainer, schedule, [&](double part) { parts.push_back(part); });
  CHECK(trainer.steps() == 4);
  CHECK(parts == std::vector<double>{0, 0.25, 0.5, 0.75});
}

TEST_CASE("training_loop: what progress throws stops the training") {
  nerf::RadianceField field(trainable_field_options());
  nerf::Trainer trainer(field, objects_scene(),
                        {.schedule = {.steps = 4}, .samples_per_step = 1024, .first_samples = 1024});
  CHECK_THROWS_AS(train_to_end(trainer, {.steps = 4}, [](double) { throw ValueError("stop"); }), ValueError);
  CHECK(trainer.steps() == 0);
}
