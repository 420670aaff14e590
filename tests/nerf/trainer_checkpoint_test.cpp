#include <fieldmark/core/error.h>
#include <fieldmark/nerf/trainer.h>

#include "nerf/trainer_runs.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

TEST_CASE("trainer checkpoint: a run that is interrupted and restored gives the bytes of one that is not") {
  const TemporaryFolder folder;
  const Index at = 23,
              steps = 45;  // between two occupancy updates, after the first cells are declared empty
  {
    RadianceField field(trainable_field_options());
    Trainer trainer(field, objects_scene(), short_run_options(steps));
    while (trainer.steps() < at) trainer.step(0);
    trainer.save(folder / "checkpoint");
  }
  RadianceField field(trainable_field_options());
  Trainer trainer(field, objects_scene(), short_run_options(steps));
  trainer.restore(folder / "checkpoint");
  CHECK(trainer.steps() == at);
  while (!trainer.done()) trainer.step(0);
  CHECK(outcome_of(field, trainer) == outcome_of_run(steps));
}

TEST_CASE("trainer checkpoint: a checkpoint of another run is refused by the name of the option or input") {
  const TemporaryFolder folder;
  RadianceField field(trainable_field_options());
  Trainer trainer(field, objects_scene(), short_run_options(10));
  trainer.step(0);
  trainer.save(folder / "checkpoint");
  RadianceField other(trainable_field_options());
  TrainOptions options = short_run_options(10);
  options.seed = 7;
  Trainer different(other, objects_scene(), options);
  CHECK_THROWS_WITH(
      different.restore(folder / "checkpoint"),
      (folder / "checkpoint").string() + ": this checkpoint was made with option 'seed' 0, this run has 7");
  options = short_run_options(10);
  options.schedule.lr = 0.5;
  Trainer faster(other, objects_scene(), options);
  CHECK_THROWS_WITH(faster.restore(folder / "checkpoint"), Contains("option 'lr'") && Contains("has 0.5"));
  Dataset changed = objects_scene();
  changed.views[3].rgba[7] += 0.25f;
  Trainer of_other_images(other, changed, short_run_options(10));
  CHECK_THROWS_WITH(of_other_images.restore(folder / "checkpoint"), Contains("of another input 'image 3'"));
  field.save(folder / "field");
  CHECK_THROWS_WITH(trainer.restore(folder / "field"),
                    Contains("expected a CHECKPOINT file (kind 'checkpoint'), found kind 'field'"));
  CHECK_THROWS_AS(trainer.restore(folder / "missing"), IoError);
}

TEST_CASE("trainer checkpoint: a checkpoint knows the sizes of its field") {
  const TemporaryFolder folder;
  RadianceField field(small_field_options());
  Trainer trainer(field, objects_scene(), short_run_options(2));
  trainer.save(folder / "checkpoint");
  RadianceField same(checkpointed_field(folder / "checkpoint"));
  CHECK(same.params.size() == field.params.size());
  Trainer second(same, objects_scene(), short_run_options(2));
  second.restore(folder / "checkpoint");
  field.save(folder / "field.fm");
  CHECK_THROWS_WITH(checkpointed_field(folder / "field.fm"),
                    Contains("field.fm: expected a CHECKPOINT file"));
}
