#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>

#include "nerf/trainer_runs.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
TrainerOutcome run_mlp(Index steps) {
  RadianceField field(small_mlp_options());
  Trainer trainer(field, objects_scene(), short_mlp_run_options(steps));
  while (!trainer.done()) trainer.step(0);
  return outcome_of(field, trainer);
}
}  // namespace

TEST_CASE("trainer mlp: 300 steps of a small mlp field reach 17 dB, and both its networks learn") {
  RadianceField field(small_mlp_options());
  const RadianceField untrained(small_mlp_options());
  Trainer trainer(field, objects_scene(), short_mlp_run_options(300));
  trainer.step(0);
  const double start = trainer.train_psnr();
  while (!trainer.done()) trainer.step(0);
  CAPTURE(start, trainer.train_psnr());
  CHECK(trainer.train_psnr() > 17);
  CHECK(trainer.train_psnr() > start + 3);
  CHECK(trainer.samples() > 300 * 1000);
  for (const auto& e : field.params.entries()) {
    const std::span<const float> now = field.params.values(field.params.find(e.name)),
                                 then = untrained.params.values(untrained.params.find(e.name));
    CAPTURE(e.name);
    CHECK_FALSE(std::equal(now.begin(), now.end(), then.begin()));
  }
}

TEST_CASE("trainer mlp: an mlp field is refused where a scene has no bounds") {
  Dataset place = objects_scene();
  place.scene = SceneType::place;
  RadianceField field(small_mlp_options());
  CHECK_THROWS_WITH(Trainer(field, place, short_mlp_run_options(1)),
                    Contains("[trainer] field must be a hash field where a scene has no bounds"));
}

TEST_CASE("trainer mlp: an mlp field's bytes are the same for one and two threads, and across a restore") {
  const TemporaryFolder folder;
  const ScopedThreads serial(1);
  const TrainerOutcome one = run_mlp(12);
  const ScopedThreads parallel(2);
  CHECK(one == run_mlp(12));
  {
    RadianceField field(small_mlp_options());
    Trainer trainer(field, objects_scene(), short_mlp_run_options(12));
    while (trainer.steps() < 5) trainer.step(0);
    trainer.save(folder / "checkpoint");
  }
  RadianceField field(small_mlp_options());
  Trainer trainer(field, objects_scene(), short_mlp_run_options(12));
  trainer.restore(folder / "checkpoint");
  while (!trainer.done()) trainer.step(0);
  CHECK(outcome_of(field, trainer) == one);
}
