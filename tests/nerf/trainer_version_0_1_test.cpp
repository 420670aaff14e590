#include "trainer_version_0_1.h"

#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <vector>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {

const Dataset& small_scene() {
  static const Dataset data = make_scene({.size = 16, .views = 6});
  return data;
}

TrainOptions short_run(std::uint64_t seed = 1) {
  return {.schedule = {.steps = 24},
          .samples_per_step = 4096,
          .first_samples = 2048,
          .grow_after = 16,
          .warm_up = 8,
          .seed = seed};
}

// The options of short_run() as version 0.1 wrote them.
constexpr const char* kOptions =
    " data objects 6 views 16x16 seed 1 steps 24 samples 4096 from 2048 after 16.000000 rays 512 distortion "
    "0.000000 hard pixels 0.750000 huber 0.100000 stop 0.010000 table decay 0.100000 after 2000 supersampled "
    "after 8000 warm-up 8 lr 0.020000 half after 8000.000000 cooldown 0.300000 last 0.030000";

// Converts a checkpoint to the form of version 0.1, whose arrays each concatenate all parameters.
SafetensorsFile in_the_old_form(const SafetensorsFile& file, const RadianceField& field) {
  SafetensorsFile old;
  old.metadata = {{"of", field.configuration() + kOptions}};
  for (const auto& [name, ending] : {std::pair{"values", ""},
                                     {"mean", ".mean"},
                                     {"mean_square", ".mean_square"},
                                     {"gradients", ".gradient"}}) {
    std::vector<float> all(at(field.params.size()));
    for (const auto& e : field.params.entries()) {
      const Tensor<float> part = file.f32(e.name + ending);
      std::copy(part.data.begin(), part.data.end(), all.begin() + e.offset);
    }
    old.add(name, {std::ssize(all)}, std::span<const float>(all));
  }
  for (const auto& [name, now] :
       {std::pair{"tile_errors", "run/tile_errors"}, {"densities", "run/densities"}}) {
    const Tensor<float> numbers = file.f32(now);
    old.add(name, numbers.shape, std::span<const float>(numbers.data));
  }
  const auto bits = file.u8("run/occupied");
  old.add("bits", {std::ssize(bits)}, std::span<const std::uint8_t>(bits));
  const std::vector<std::int64_t> counts{file.i64("run/steps")[0], file.i64("run/rays_per_step")[0],
                                         file.i64("run/planned")[0]};
  old.add("counts", {3}, std::span<const std::int64_t>(counts));
  const std::vector<double> sums{file.f64("run/samples").data[0], file.f64("run/loss").data[0]};
  old.add("sums", {2}, std::span<const double>(sums));
  return old;
}

std::vector<float> parameters(const RadianceField& f) {
  return {f.params.values().begin(), f.params.values().end()};
}

}  // namespace

TEST_CASE("trainer_version_0_1: a run resumes from a checkpoint of version 0.1 to the same bytes") {
  const TemporaryFolder folder;
  RadianceField whole(trainable_field_options());
  Trainer undisturbed(whole, small_scene(), short_run());
  for (int step = 0; step < 10; ++step) undisturbed.step(0);
  undisturbed.save(folder / "now");
  CHECK(!undisturbed.from_earlier_version());
  in_the_old_form(SafetensorsFile::read(folder / "now"), whole).write(folder / "old");
  while (!undisturbed.done()) undisturbed.step(0);

  const RadianceFieldOptions options = checkpointed_field(folder / "old");
  CHECK(options.field.encoding.log2_table == trainable_field_options().field.encoding.log2_table);
  CHECK(options.occupancy == trainable_field_options().occupancy);
  RadianceField field(trainable_field_options());
  Trainer resumed(field, small_scene(), short_run());
  resumed.restore(folder / "old");
  CHECK(resumed.from_earlier_version());
  CHECK(resumed.steps() == 10);
  while (!resumed.done()) resumed.step(0);
  CHECK(parameters(field) == parameters(whole));
}

TEST_CASE("trainer_version_0_1: a checkpoint of another run, or without its parts, is refused") {
  const TemporaryFolder folder;
  RadianceField field(trainable_field_options());
  Trainer trainer(field, small_scene(), short_run());
  trainer.step(0);
  trainer.save(folder / "now");
  const SafetensorsFile now = SafetensorsFile::read(folder / "now");
  CHECK(configuration_of_version_0_1(now).empty());
  SafetensorsFile old = in_the_old_form(now, field);
  CHECK(configuration_of_version_0_1(old) == field.configuration());
  old.write(folder / "old");
  Trainer other_seed(field, small_scene(), short_run(2));
  CHECK_THROWS_WITH(other_seed.restore(folder / "old"),
                    Contains("expected data objects 6 views 16x16 seed 2") &&
                        Contains("found data objects 6 views 16x16 seed 1"));
  old.metadata["of"] = std::string("{}") + kOptions;
  old.write(folder / "another");
  CHECK_THROWS_WITH(trainer.restore(folder / "another"),
                    (folder / "another").string() + ": a checkpoint of version 0.1 of another field");
  SafetensorsFile without;
  without.metadata = {{"of", field.configuration() + kOptions}};
  without.write(folder / "without");
  CHECK_THROWS_WITH(trainer.restore(folder / "without"), Contains("expected a tensor \"values\""));
}
