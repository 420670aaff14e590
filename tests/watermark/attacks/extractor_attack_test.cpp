#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/rendered_dataset.h>
#include <fieldmark/watermark/attacks/extractor_attack.h>

#include <algorithm>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

std::vector<float> signs(const Owner& owner, const Tensor<float>& view_image) {
  Tape<float> tape;
  const Shape shape{1, view_image.shape[0], view_image.shape[1], 3};
  const Params<float> params(owner.params, nullptr);
  const Var<float> image = tape.constant(view_image.data.data(), shape);
  const Var<float> logits = owner.mark().has_cells()
                                ? dynamic_cast<const CellMark&>(owner.mark()).reader()(params, image).sign
                                : dynamic_cast<const FusionMark&>(owner.mark()).reader()(params, image);
  return {logits.value(), logits.value() + logits.shape().size()};
}

// Returns the share of signs that differ.
double turned(const Owner& owner, const Tensor<float>& a, const Tensor<float>& b) {
  const auto before = signs(owner, a), after = signs(owner, b);
  double count = 0;
  for (std::size_t i = 0; i < before.size(); ++i) count += (before[i] > 0) != (after[i] > 0);
  return count / static_cast<double>(before.size());
}

// Returns the image of a view in the middle of the scale, so that nothing clips at black or white.
Tensor<float> image_of(const CachedView& v) {
  Tensor<float> view_image = v.base;
  for (float& x : view_image.data) x = 0.25f + 0.5f * x;
  return view_image;
}

}  // namespace

TEST_CASE("extractor_attack: the extractor takes back more than after noise of the same strength") {
  const CachedView& view = tiny_views()[0];
  const Tensor<float> view_image = image_of(view);
  for (const Owner& owner : {tiny_owner(), tiny_paper_owner()}) {
    const ExtractorAttackOptions options{.mark_psnr = 24, .steps = 12, .seed = 3};
    const Tensor<float> changed = against_extractor(owner, view_image, view.opacity, options);
    CHECK(psnr_masked(changed, view_image, view.opacity) == Approx(24).margin(0.05));
    for (Index p = 0; p < view.opacity.size(); ++p)
      if (view.opacity[p] <= 0.5f)
        for (Index c = 0; c < 3; ++c) REQUIRE(changed[3 * p + c] == view_image[3 * p + c]);
    // A single step of almost zero length leaves the noise that the ascent starts from.
    const Tensor<float> noise = against_extractor(owner, view_image, view.opacity,
                                                  {.mark_psnr = 24, .steps = 1, .step = 1e-9, .seed = 3});
    CHECK(psnr_masked(noise, view_image, view.opacity) == Approx(24).margin(0.05));
    CHECK(turned(owner, view_image, changed) > turned(owner, view_image, noise) + 0.2);
  }
}

TEST_CASE("extractor_attack: images of a field are novel views that differ on the object only") {
  const Owner owner = tiny_owner();
  const ExtractorAttackOptions options{.mark_psnr = 26, .steps = 2, .seed = 4};
  const nerf::Dataset data = renders_against_extractor(owner, owner.field, 2, options);
  REQUIRE(data.views.size() == 2);
  nerf::Renderer renderer(owner.field);
  for (const nerf::View& view : data.views) {
    CHECK(view.camera.width == owner.options().reader_size);
    const nerf::Rendering plain = renderer.render(view.camera);
    const Tensor<float> seen = nerf::composited(view, owner.field.background);
    CHECK(psnr_masked(seen, plain.rgb, plain.opacity) == Approx(26).margin(1));
    CHECK(psnr(seen, plain.rgb) > 26);
    const nerf::Camera camera[] = {view.camera};
    const Tensor<float> before = nerf::rendered_dataset(owner.field, camera).views[0].rgba;
    for (Index p = 0; p < before.size() / 4; ++p) {
      REQUIRE(view.rgba[4 * p + 3] == before[4 * p + 3]);
      for (Index c = 0; before[4 * p + 3] <= 0.5f && c < 3; ++c)
        REQUIRE(view.rgba[4 * p + c] == before[4 * p + c]);
    }
  }
  CHECK(data.views[0].rgba.data != data.views[1].rgba.data);
  CHECK_THROWS_WITH(
      renders_against_extractor(owner, owner.field, 2, options, [](Index, Index) { return false; }),
      Contains("stopped while attacking the extractor"));
}

TEST_CASE("extractor_attack: the same bits for any thread count") {
  const Owner owner = tiny_owner();
  const CachedView& view = tiny_views()[1];
  const auto run = [&] { return against_extractor(owner, view.base, view.opacity, {.steps = 2}).data; };
  const ScopedThreads serial(1);
  const auto one = run();
  const ScopedThreads parallel(2);
  CHECK(run() == one);
}

TEST_CASE("extractor_attack: errors name what is wrong") {
  const Owner owner = tiny_owner();
  const CachedView& view = tiny_views()[0];
  const auto run = [&](ExtractorAttackOptions o) {
    return against_extractor(owner, view.base, view.opacity, o);
  };
  CHECK_THROWS_WITH(run({.mark_psnr = 9}), "[extractor_attack] mark_psnr must be 10 to 60 dB, got 9");
  CHECK_THROWS_WITH(run({.steps = 0}), "[extractor_attack] steps must be at least 1, got 0");
  CHECK_THROWS_WITH(run({.step = 0}), Contains("step must be above 0 and at most 1, got 0"));
  CHECK_THROWS_WITH(against_extractor(owner, view.base, Tensor<float>({3, 4}), {}),
                    Contains("object [H, W], got [48, 48, 3] and [3, 4]"));
}
