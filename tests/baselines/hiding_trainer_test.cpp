#include "hiding_trainer.h"
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

HidingTrainOptions tiny(Index steps) {
  HidingTrainOptions o;
  o.schedule.steps = steps;
  o.batch = 2;
  o.crop = 32;
  o.first_crop = 16;
  o.first_part = 0.5;
  o.first_mark_psnr = o.mark_psnr;  // files and noise layers from the first step on
  return o;
}

ImageMarker tiny_marker(HidingKind kind) { return {kind, {.bits = 2, .channels = 8}, 1}; }

}  // namespace

TEST_CASE("hiding_trainer: the same numbers for any threads and across a checkpoint") {
  const TemporaryFolder folder;
  const CropSource crops({}, 1);
  for (const HidingKind kind : {HidingKind::hidden, HidingKind::mbrs}) {
    CAPTURE(hiding_name(kind));
    ImageMarker one = tiny_marker(kind), two = tiny_marker(kind);
    const ScopedThreads serial(1);
    HidingTrainer straight(one, crops, tiny(6));
    while (!straight.done()) straight.step(0);
    const ScopedThreads parallel(2);
    {
      ImageMarker begun = tiny_marker(kind);
      HidingTrainer first(begun, crops, tiny(6));
      for (int k = 0; k < 4; ++k) first.step(0);
      first.save(folder / "c");
    }
    HidingTrainer second(two, crops, tiny(6));
    second.restore(folder / "c");
    CHECK(second.steps() == 4);
    while (!second.done()) second.step(0);
    CHECK(std::ranges::equal(one.params.values(), two.params.values()));
    CHECK(second.figures().bits == straight.figures().bits);
    CHECK(std::ranges::equal(second.read(), straight.read()));
    CHECK_THAT(second.status(), Contains("% of the worst, at 30.0 dB"));
    CHECK(second.steps() == 6);
  }
}

TEST_CASE("hiding_trainer: one bit is learnt in some steps") {
  const CropSource crops({}, 1);
  ImageMarker marker(HidingKind::hidden, {.bits = 1, .channels = 8}, 1);
  HidingTrainOptions options = tiny(150);
  options.batch = 8;
  options.first_mark_psnr = 14;
  options.crop = 16;
  options.schedule.lr = 5e-3;
  HidingTrainer trainer(marker, crops, options);
  while (!trainer.done()) trainer.step(0);
  INFO("bits right " << trainer.figures().bits << ", " << trainer.figures().mark_psnr << " dB");
  CHECK(trainer.figures().bits > 0.8);
  CHECK(trainer.figures().mark_psnr > options.first_mark_psnr);
}

TEST_CASE("hiding_trainer: the mark fades only while all bits and each of them are right") {
  const auto all = [](float fraction) { return std::vector<float>(16, fraction); };
  CHECK(fading(all(0.92f)) == 0);
  CHECK(fading(all(0.94f)) == 0.015);
  CHECK(fading(all(1.f)) == Approx(0.015 + 2 * 0.04));
  std::vector<float> one_late = all(0.97f);
  CHECK(fading(one_late) > 0.015);
  one_late[5] = 0.84f;
  CHECK(fading(one_late) == 0);
  one_late[5] = 0.86f;
  CHECK(fading(one_late) > 0);
  one_late[5] = std::nanf("");
  CHECK(fading(one_late) == 0);
}

TEST_CASE("hiding_trainer: the authors' weights, and errors") {
  CHECK(hiding_train_options(HidingKind::hidden).message_weight == 1);
  CHECK(hiding_train_options(HidingKind::mbrs).message_weight == 10);
  CHECK(hiding_train_options(HidingKind::mbrs).adversary_weight == 1e-4);
  const TemporaryFolder folder;
  const CropSource crops({}, 1);
  ImageMarker marker = tiny_marker(HidingKind::hidden);
  HidingTrainOptions options = tiny(2);
  options.crop = 40;
  CHECK_THROWS_WITH(HidingTrainer(marker, crops, options),
                    "[hiding_trainer] batch must be at least 2 and both crops multiples of 16, got 2, 40 and "
                    "16");
  options = tiny(2);
  options.first_part = 1;
  CHECK_THROWS_WITH(HidingTrainer(marker, crops, options),
                    Contains("[hiding_trainer] first_part must be at least 0 and below 1, got 1"));
  options = tiny(2);
  options.mark_psnr = 10;
  CHECK_THROWS_WITH(HidingTrainer(marker, crops, options),
                    Contains("[hiding_trainer] mark_psnr must be at least first_mark_psnr, got 10"));
  options = tiny(2);
  options.noisy_part = 1.5;
  CHECK_THROWS_WITH(HidingTrainer(marker, crops, options),
                    Contains("[hiding_trainer] noisy_part must be in [0, 1], got 1.5"));
  HidingTrainer trainer(marker, crops, tiny(2));
  trainer.save(folder / "c");
  ImageMarker other = tiny_marker(HidingKind::mbrs);
  HidingTrainer of_other(other, crops, tiny(2));
  CHECK_THROWS_WITH(of_other.restore(folder / "c"),
                    Contains("option 'run' \"hidden\", this run has \"mbrs\""));
}
