#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {

constexpr Index kSize = 24, kParts = 8;

// Training images whose pixels are means of kParts x kParts of the scene's, with colours weighted by alpha.
Dataset blurred_scene(Index views = 12, const char* split = "train") {
  Dataset data = make_scene({.size = kSize * kParts, .views = views}, split);
  for (View& v : data.views) {
    for (Index p = 0; p < kSize * kParts * kSize * kParts; ++p)
      for (Index k = 0; k < 3; ++k) v.rgba[4 * p + k] *= v.rgba[4 * p + 3];
    v.rgba = resize_area(v.rgba, kSize, kSize);
    for (Index p = 0; p < kSize * kSize; ++p)
      for (Index k = 0; k < 3; ++k) v.rgba[4 * p + k] /= std::max(v.rgba[4 * p + 3], 1e-6f);
    v.camera = v.camera.scaled(kSize, kSize);
  }
  return data;
}

RadianceFieldOptions field_options(Index supersampling) {
  RadianceFieldOptions options = trainable_field_options();
  options.supersampling = supersampling;
  return options;
}

TrainOptions train_options(Index steps, Index after) {
  return {.schedule = {.steps = steps},
          .samples_per_step = 8192,
          .first_samples = 4096,
          .grow_after = 16,
          .supersample_after = after,
          .warm_up = 16};
}

std::vector<float> numbers(const RadianceField& f) {
  return {f.params.values().begin(), f.params.values().end()};
}

RadianceField trained_field(const Dataset& data, Index supersampling, const TrainOptions& options) {
  RadianceField field(field_options(supersampling));
  Trainer trainer(field, data, options);
  while (!trainer.done()) trainer.step(0);
  return field;
}

std::vector<float> trained(const Dataset& data, Index supersampling, Index after, Index steps) {
  return numbers(trained_field(data, supersampling, train_options(steps, after)));
}

TrainOptions uncarved(Index steps) {
  TrainOptions options = train_options(steps, 0);
  options.carve = false;
  return options;
}

}  // namespace

TEST_CASE(
    "trainer_rays: a field taught with means over pixels is nearer to training images that are such means") {
  const Dataset data = blurred_scene(40), judge = blurred_scene(6, "val");  // of rays that nothing learned
  const auto psnr = [&](const RadianceField& field, Index rays) {
    Renderer renderer(field, {.supersampling = rays});
    return evaluate(renderer, judge).psnr;
  };
  const RadianceField by_centres = trained_field(data, 1, train_options(400, 100)),
                      by_means = trained_field(data, 2, train_options(400, 100));
  const double centres = psnr(by_centres, 1), shown = psnr(by_centres, 2), taught = psnr(by_means, 2);
  CAPTURE(centres, shown, taught);
  CHECK(taught > shown + 0.5);
  CHECK(taught > centres + 0.5);
  CHECK(psnr(by_means, 0) == taught);
}

TEST_CASE("trainer_rays: colours are learnt at the offsets of their pixels") {
  const auto learnt = [&](float across, float down, double cx, double cy) {
    Dataset data = make_scene({.size = 24, .views = 6});
    for (View& v : data.views) {
      v.offsets = std::make_shared<PixelOffsets>(24 * 24, std::array{across, down});
      v.camera.cx += cx, v.camera.cy += cy;
    }
    return numbers(trained_field(data, 1, uncarved(20)));
  };
  // A principal point that is moved the other way gives the same rays.
  CHECK(learnt(0.25f, -0.5f, 0, 0) == learnt(0, 0, -0.25, 0.5));
  CHECK(learnt(0.25f, -0.5f, 0, 0) != learnt(0, 0, 0, 0));
  Dataset data = make_scene({.size = 24, .views = 2});
  data.views[1].offsets = std::make_shared<PixelOffsets>(5);
  RadianceField field(field_options(1));
  CHECK_THROWS_WITH(Trainer(field, data, train_options(1, 0)),
                    "[trainer] data must have an offset for each pixel, got 5 for view r_1");
}

TEST_CASE("trainer_rays: every pixel of every view has its own offset") {
  // Half of the views show at each pixel what is three columns to the right, the others what is as far below.
  const Dataset judge = make_scene({.size = 24, .views = 12});
  const auto learnt = [&](bool offsets) {
    Dataset data = judge;
    for (std::size_t v = 0; v < data.views.size(); ++v) {
      PixelOffsets of_pixels(24 * 24);
      for (Index p = 0; p < 24 * 24; ++p) {
        const Index right = v % 2 == 0 && p % 24 < 21 ? 3 : 0, below = v % 2 == 1 && p / 24 < 21 ? 3 : 0;
        of_pixels[at(p)] = {static_cast<float>(right), static_cast<float>(below)};
        std::copy_n(&judge.views[v].rgba[4 * (p + right + 24 * below)], 4, &data.views[v].rgba[4 * p]);
      }
      if (offsets) data.views[v].offsets = std::make_shared<PixelOffsets>(std::move(of_pixels));
    }
    const RadianceField field = trained_field(data, 1, uncarved(150));
    Renderer renderer(field);
    return evaluate(renderer, judge).psnr;
  };
  const double with = learnt(true), without = learnt(false);
  CAPTURE(with, without);
  CHECK(with > without + 3);
}

TEST_CASE("trainer_rays: supersampling begins after its steps, and only then") {
  const Dataset data = blurred_scene();
  CHECK(trained(data, 2, 10, 10) == trained(data, 1, 0, 10));
  CHECK(trained(data, 2, 9, 10) != trained(data, 1, 0, 10));
  CHECK(trained(data, 2, 0, 10) != trained(data, 4, 0, 10));
}

TEST_CASE("trainer_rays: supersampled steps give the same bytes for any thread count and across a restore") {
  const Dataset data = blurred_scene();
  const ScopedThreads serial(1);
  const std::vector<float> one = trained(data, 2, 8, 24);
  const ScopedThreads parallel(2);
  CHECK(trained(data, 2, 8, 24) == one);

  const TemporaryFolder folder;
  {
    RadianceField field(field_options(2));
    Trainer trainer(field, data, train_options(24, 8));
    while (trainer.steps() < 13) trainer.step(0);
    trainer.save(folder / "checkpoint");
  }
  RadianceField field(field_options(2));
  Trainer trainer(field, data, train_options(24, 8));
  trainer.restore(folder / "checkpoint");
  while (!trainer.done()) trainer.step(0);
  CHECK(numbers(field) == one);
  Trainer other(field, data, train_options(24, 9));
  CHECK_THROWS_WITH(other.restore(folder / "checkpoint"),
                    Contains("option 'supersample_after' 8, this run has 9"));
}

TEST_CASE("trainer_rays: hard pixels are sought where the error is") {
  // A scene that is learned within the run, except for a patch of noise that differs between images.
  Dataset data = make_scene({.kind = SceneKind::sphere, .size = 48, .views = 8});
  const CounterRng rng(1);
  for (std::size_t v = 0; v < data.views.size(); ++v)
    for (Index p = 0; p < 48 * 48; ++p)
      if (p % 48 >= 20 && p % 48 < 28 && p / 48 >= 20 && p / 48 < 28)
        for (Index k = 0; k < 3; ++k)
          data.views[v].rgba[4 * p + k] =
              rng.uniform4(v, static_cast<std::uint64_t>(p))[static_cast<std::size_t>(k)];
  const auto psnr = [&](double share) {
    RadianceField field(trainable_field_options());
    TrainOptions options = train_options(150, 0);
    options.first_samples = 2048;
    options.distortion = 1e-3;
    options.hard_pixels = share;
    Trainer trainer(field, data, options);
    while (!trainer.done()) trainer.step(0);
    return trainer.train_psnr();
  };
  const double even = psnr(0), half = psnr(0.5), all = psnr(1);
  CAPTURE(even, half, all);
  // The chosen rays are harder: more of them hit the noise.
  CHECK(half < even - 0.5);
  CHECK(all < half - 0.5);
}

TEST_CASE("trainer_rays: what masks exclude is not learnt, carved or not") {
  Dataset data = blurred_scene();
  for (View& v : data.views) {
    v.valid.assign(kSize * kSize, 1);
    for (Index p = 0; p < kSize * kSize; ++p)
      if (p % kSize < kSize / 3) v.valid[static_cast<std::size_t>(p)] = 0;
  }
  Dataset other = data, whole = data;
  for (View& v : other.views)
    for (Index p = 0; p < kSize * kSize; ++p)
      if (p % kSize < kSize / 3) std::fill_n(&v.rgba[4 * p], 4, 1.f);
  for (View& v : whole.views) v.valid.clear();
  for (const bool carve : {true, false}) {
    const auto learnt = [&](const Dataset& from) {
      TrainOptions options = train_options(12, 100);
      options.carve = carve;
      return numbers(trained_field(from, 1, options));
    };
    const auto masked = learnt(data);
    CHECK(learnt(other) == masked);
    CHECK(learnt(whole) != masked);
  }
  for (View& v : data.views) std::ranges::fill(v.valid, 0);
  RadianceField field(field_options(1));
  CHECK_THROWS_WITH(Trainer(field, data, train_options(1, 0)),
                    "[trainer] data must have a valid pixel, got none: masks exclude all");
}

TEST_CASE("trainer_rays: a checkpoint knows the masks and the offsets that it was trained with") {
  Dataset data = blurred_scene();
  const TemporaryFolder folder;
  {
    RadianceField field(field_options(1));
    Trainer trainer(field, data, train_options(4, 0));
    trainer.save(folder / "checkpoint");
  }
  data.views[2].valid.assign(kSize * kSize, 1);
  data.views[2].valid[5] = 0;
  RadianceField field(field_options(1));
  Trainer trainer(field, data, train_options(4, 0));
  CHECK_THROWS_WITH(trainer.restore(folder / "checkpoint"), Contains("mask 2"));
  data.views[2].valid.clear();
  data.views[3].offsets = std::make_shared<PixelOffsets>(kSize * kSize);
  Trainer beside(field, data, train_options(4, 0));
  CHECK_THROWS_WITH(beside.restore(folder / "checkpoint"), Contains("offsets 3"));
}

TEST_CASE("trainer_rays: errors name option and value") {
  const Dataset data = blurred_scene();
  RadianceField field(field_options(2));
  CHECK_THROWS_WITH(Trainer(field, data, train_options(1, -1)),
                    "[trainer] supersample_after must be at least 0, got -1");
  TrainOptions options = train_options(1, 0);
  options.table_decay = -0.5;
  CHECK_THROWS_WITH(Trainer(field, data, options),
                    Contains("[trainer] table_decay must be at least 0, got -0.5"));
  options = train_options(1, 0);
  options.decay_after = -2;
  CHECK_THROWS_WITH(Trainer(field, data, options), "[trainer] decay_after must be at least 0, got -2");
  RadianceFieldOptions mlp = small_mlp_options();
  mlp.supersampling = 2;
  RadianceField original(mlp);
  CHECK_THROWS_WITH(Trainer(original, data, train_options(1, 0)),
                    "[trainer] field must be a hash field to have supersampling, got an mlp field");
}

TEST_CASE("trainer_rays: a step has the least rays however many samples they have") {
  // All cells are occupied: a ray has so many samples that 1024 of them make only a few rays.
  const Dataset data = make_scene({.size = 48, .views = 12});
  const auto samples_of = [&](Index least) {
    RadianceField field(small_field_options());
    Trainer trainer(
        field, data,
        {.schedule = {.steps = 1}, .samples_per_step = 1024, .first_samples = 1024, .least_rays = least});
    trainer.step(0);
    return trainer.samples();
  };
  const double few = samples_of(64), many = samples_of(256);
  CHECK(few > 0);
  CHECK(many > 3 * few);
  CHECK(many < 5 * few);
}
