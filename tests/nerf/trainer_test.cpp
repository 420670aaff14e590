#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "nerf/trainer_runs.h"
#include "support/catch.h"
#include "support/each_isa.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

TEST_CASE("trainer: 100 steps on the built-in scene reach 19 dB") {
  RadianceField field(trainable_field_options());
  TrainOptions options = short_run_options(100);
  options.first_samples = options.samples_per_step;
  options.hard_pixels = 0;  // so that the loss is that of evenly drawn rays
  Trainer trainer(field, objects_scene(), options);
  trainer.step(0);
  const double start = trainer.train_psnr();
  while (!trainer.done()) trainer.step(0);
  CAPTURE(start, trainer.train_psnr());
  CHECK(trainer.steps() == 100);
  CHECK(trainer.planned() == 100);
  CHECK(trainer.train_psnr() > 19);
  CHECK(trainer.train_psnr() > start + 5);
  CHECK(field.grid.occupied_cells() < field.grid.cells() / 2);
  CHECK(field.grid.occupied_cells() > 0);
}

TEST_CASE("trainer: a field that is kept goes on from where it was, in its space and its cells") {
  RadianceField field(trainable_field_options());
  {
    Trainer trainer(field, objects_scene(), short_run_options(60));
    while (!trainer.done()) trainer.step(0);
  }
  const std::string configuration = field.configuration();
  const std::vector<std::uint8_t> occupied(field.grid.bits().begin(), field.grid.bits().end());
  Dataset elsewhere = objects_scene();  // cameras and background of the other data set must not be adopted
  elsewhere.views.resize(3);
  elsewhere.background = Background::black;
  const auto further = [&](bool keep) {
    RadianceField f = field;
    TrainOptions options = short_run_options(30);
    options.schedule.lr = 5e-3;
    options.hard_pixels = 0;  // so that the loss is that of evenly drawn rays
    options.keep = keep;
    Trainer trainer(f, elsewhere, options);
    trainer.step(0);
    const double start = trainer.train_psnr();
    while (!trainer.done()) trainer.step(0);
    CAPTURE(keep, start, trainer.train_psnr());
    CHECK(start > 15);
    CHECK(trainer.train_psnr() > start);
    return f;
  };
  const RadianceField kept = further(true), moved = further(false);
  CHECK(kept.configuration() == configuration);
  CHECK(moved.configuration() != configuration);
  Index beyond = 0;
  for (std::size_t c = 0; c < occupied.size(); ++c) beyond += kept.grid.bits()[c] && !occupied[c];
  CHECK(beyond == 0);
  CHECK_FALSE(std::ranges::equal(kept.params.values(), field.params.values()));
}

TEST_CASE("trainer: without carving, silhouettes leave bounds and cells alone") {
  RadianceField field(small_mlp_options());
  TrainOptions options = short_mlp_run_options(2);
  options.carve = false;
  Trainer trainer(field, objects_scene(), options);
  CHECK(field.space.bounds.side == 3);
  CHECK(field.grid.occupied_cells() == field.grid.cells());
  trainer.step(0);
  CHECK(std::isfinite(trainer.train_psnr()));
}

TEST_CASE("trainer: sets bounds, background and cameras of the field from the data") {
  RadianceFieldOptions options = trainable_field_options();
  options.occupancy = 64;
  RadianceField field(options);
  // Many cameras, so that the hull lies well inside the first cube on all sides.
  const Dataset sphere = make_scene({.kind = SceneKind::sphere, .size = 48, .views = 40});
  const Trainer trainer(field, sphere, short_run_options(10));
  CHECK(field.space.bounds.side < 2.9);
  CHECK(field.background == Background::white);
  CHECK(field.cameras.directions.size() == 40);
  CHECK(field.grid.occupied_cells() < field.grid.cells());
}

TEST_CASE("trainer: opaque images leave bounds and cells alone") {
  Dataset opaque = objects_scene();
  for (View& v : opaque.views)
    for (Index i = 3; i < v.rgba.size(); i += 4) v.rgba[i] = 1;
  RadianceField field(trainable_field_options());
  Trainer trainer(field, opaque, short_run_options(2));
  CHECK(field.space.bounds.side == 3);
  CHECK(field.grid.occupied_cells() == field.grid.cells());
  trainer.step(0);
  CHECK(std::isfinite(trainer.train_psnr()));
}

TEST_CASE("trainer: the same bytes for one and two threads, on each instruction set") {
  each_isa([] {
    const ScopedThreads serial(1);
    const TrainerOutcome one = outcome_of_run(20);
    const ScopedThreads parallel(2);
    const TrainerOutcome two = outcome_of_run(20);
    CHECK(one == two);
  });
}

TEST_CASE("trainer: a timed run's steps, given as a number, give the same bytes") {
  RadianceField field(trainable_field_options());
  TrainOptions options = short_run_options(0);
  options.schedule.seconds = 1;
  Trainer trainer(field, objects_scene(), options);
  double now = 0;
  for (; !trainer.done(); now += 0.025) trainer.step(now);
  CHECK(trainer.steps() == trainer.planned());
  CHECK((now > 0.9 && now < 1.05));
  CHECK_FALSE(trainer.replanned());
  CHECK(outcome_of(field, trainer) == outcome_of_run(trainer.planned()));
}

TEST_CASE("trainer: hashed levels take turns while steps are small, and the last step leaves no gradient") {
  RadianceField field(trainable_field_options());
  const HashEncoding<float>& encoding = field.field.encoding();
  const Index entry = 2 * encoding.features();
  Trainer trainer(field, objects_scene(), short_run_options(40));
  // True if a level still holds gradients after the step.
  const auto waits = [&](int level) {
    const auto grads = field.params.grads(encoding.table());
    const auto rows = grads.subspan(
        static_cast<std::size_t>(encoding.first_row(level) * entry),
        static_cast<std::size_t>((encoding.first_row(level + 1) - encoding.first_row(level)) * entry));
    return std::ranges::any_of(rows, [](float g) { return g != 0; });
  };
  int hashed = 0;
  for (int step = 0; step < 8; ++step) {
    trainer.step(0);
    for (int level = 0; level < encoding.levels(); ++level) {
      CAPTURE(step, level);
      if (encoding.mask(level) != 0) ++hashed;
      CHECK(waits(level) == (encoding.mask(level) != 0 && (step + level) % 4 != 0));  // 8192 / 2048
    }
  }
  CHECK(hashed > 0);
  while (!trainer.done()) trainer.step(0);
  for (int level = 0; level < encoding.levels(); ++level) CHECK_FALSE(waits(level));
}

TEST_CASE("trainer: decay keeps the table small, after its steps and nothing before") {
  const auto table_of = [](double decay, Index after) {
    RadianceField field(trainable_field_options());
    TrainOptions options = short_run_options(60);
    options.table_decay = decay;
    options.decay_after = after;
    Trainer trainer(field, objects_scene(), options);
    while (!trainer.done()) trainer.step(0);
    const auto table = field.params.values(field.field.encoding().table());
    return std::vector<float>(table.begin(), table.end());
  };
  const auto size = [](const std::vector<float>& x) {
    return std::inner_product(x.begin(), x.end(), x.begin(), 0.0);
  };
  const std::vector<float> free = table_of(0, 0);
  CHECK(size(table_of(5, 30)) < 0.9 * size(free));
  CHECK(size(table_of(5, 0)) < 0.9 * size(table_of(5, 30)));
  CHECK(table_of(5, 60) == free);
}

TEST_CASE("trainer: the distortion loss leaves less fog") {
  const auto occupied = [](double weight) {
    RadianceField field(trainable_field_options());
    TrainOptions options = short_run_options(120);
    options.distortion = weight;
    options.carve = false;
    Trainer trainer(field, objects_scene(), options);
    while (!trainer.done()) trainer.step(0);
    return field.grid.occupied_cells();
  };
  const Index without = occupied(0), with = occupied(0.1);
  CAPTURE(without, with);
  CHECK(static_cast<double>(with) < 0.9 * static_cast<double>(without));
}

TEST_CASE("trainer: errors name option and value") {
  RadianceField field(trainable_field_options());
  TrainOptions options = short_run_options(1);
  options.samples_per_step = 10;
  CHECK_THROWS_WITH(Trainer(field, objects_scene(), options),
                    "[trainer] samples_per_step must be at least 1024, got 10");
  CHECK_THROWS_WITH(Trainer(field, objects_scene(), {.first_samples = 10}),
                    "[trainer] first_samples must be at least 1024, got 10");
  CHECK_THROWS_WITH(Trainer(field, objects_scene(), {.distortion = -1}),
                    "[trainer] distortion must be at least 0, got -1");
  CHECK_THROWS_WITH(Trainer(field, objects_scene(), {.hard_pixels = 2}),
                    "[trainer] hard_pixels must be in [0, 1], got 2");
  CHECK_THROWS_WITH(Trainer(field, objects_scene(), {.grow_after = 0}),
                    "[trainer] grow_after must be positive, got 0");
  CHECK_THROWS_WITH(Trainer(field, objects_scene(), {.least_rays = 100}),
                    "[trainer] least_rays must be a multiple of 64, 64 to 65536, got 100");
  CHECK_THROWS_WITH(Trainer(field, objects_scene(), {.stop = 1}), "[trainer] stop must be in [0, 1), got 1");
  CHECK_THROWS_WITH(Trainer(field, Dataset{}, short_run_options(1)),
                    "[trainer] data must have at least one view");
}

TEST_CASE("trainer: a run gets a field that it can fill") {
  using Case = std::tuple<ScheduleOptions, int, double, Index>;
  const HashEncodingOptions middle{};
  for (const auto& [length, log2_table, finest, width] :
       {Case{ScheduleOptions{.seconds = 20}, 17, 512, 32}, Case{ScheduleOptions{.seconds = 120}, 17, 512, 32},
        Case{ScheduleOptions{.seconds = 121}, middle.log2_table, middle.finest_resolution, 32},
        Case{ScheduleOptions{.seconds = 400}, middle.log2_table, middle.finest_resolution, 32},
        Case{ScheduleOptions{.seconds = 401}, 19, 1024, 64},
        Case{ScheduleOptions{.steps = 8000, .seconds = 900}, 17, 512, 32},
        Case{ScheduleOptions{.steps = 8001, .seconds = 1}, middle.log2_table, middle.finest_resolution, 32},
        Case{ScheduleOptions{.steps = 20001, .seconds = 1}, 19, 1024, 64}}) {
    CAPTURE(length.steps, length.seconds);
    const FieldOptions sizes = field_options(length).field;
    CHECK(sizes.encoding.log2_table == log2_table);
    CHECK(sizes.encoding.finest_resolution == finest);
    CHECK(sizes.width == width);
  }
}
