#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/watermark/embedding/mark_psnr_meter.h>

#include <cmath>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Darkens every colour by a known step.
nerf::Renderer::Recolour darker_by(float step) {
  return [step](const float*, const float*, Index n, float* rgb) {
    for (Index i = 0; i < 3 * n; ++i) rgb[i] -= step;
  };
}
}  // namespace

TEST_CASE(
    "mark_psnr_meter: the mean over novel views of what psnr_masked says of each, called view by view") {
  const Owner owner = tiny_owner();
  const MarkPsnrViews views{.count = 5, .side = 1000, .seed = 9};  // capped at the training images' size
  nerf::Renderer plain(owner.field), marked(owner.field);
  double sum = 0;
  const auto cameras = nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, 5, 0, 9);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    marked.set_recolour(darker_by(0.01f * static_cast<float>(i + 1)));
    const nerf::Rendering base = plain.render(cameras[i]);
    sum += psnr_masked(marked.render(cameras[i]).rgb, base.rgb, base.opacity);
  }
  nerf::Renderer renderer(owner.field);
  std::vector<Index> called;
  const double mark_psnr = MarkPsnrMeter(owner.field, views)(renderer, [&](Index i) {
    called.push_back(i);
    renderer.set_recolour(darker_by(0.01f * static_cast<float>(i + 1)));
  });
  CHECK(mark_psnr == Approx(sum / 5).epsilon(1e-12));
  CHECK(called == std::vector<Index>{0, 1, 2, 3, 4});
  called.clear();
  MarkPsnrMeter(owner.field, views)(
      renderer, [&](Index i) { called.push_back(i); }, 2);
  CHECK(called == std::vector<Index>{0, 2, 4});
  CHECK(MarkPsnrMeter(owner.field, views).guess_step() == 1);
}

TEST_CASE("mark_psnr_meter: views of fewer pixels say the same of a mark as large ones") {
  const Owner owner = tiny_owner();
  nerf::Renderer renderer(owner.field);
  renderer.set_recolour(darker_by(0.03f));
  const auto at = [&](Index side) {
    return MarkPsnrMeter(owner.field, {.count = 24, .side = side})(renderer);
  };
  const double large = at(1000), small = at(12);
  CAPTURE(large, small);
  CHECK(large == Approx(-20 * std::log10(0.03)).margin(1));
  CHECK(small == Approx(large).margin(0.15));
}

TEST_CASE("mark_psnr_meter: a field with supersampling is measured by single rays") {
  const nerf::RadianceField& single = tiny_field();
  nerf::RadianceFieldOptions options = single.options();
  options.supersampling = 4;
  nerf::RadianceField several(options);
  several.params = single.params;
  several.grid = single.grid;
  several.space = single.space;
  several.cameras = single.cameras;
  several.background = single.background;
  // A mark finer than a pixel, which averaging the rays of a pixel would hide.
  const nerf::Renderer::Recolour fine = [](const float* x, const float*, Index n, float* rgb) {
    for (Index i = 0; i < n; ++i)
      for (Index a = 0; a < 3; ++a)
        rgb[3 * i + a] = 0.5f + 0.05f * std::sin(700 * x[3 * i] + 500 * x[3 * i + 1] + 300 * x[3 * i + 2]);
  };
  const auto mark_psnr = [&](const nerf::RadianceField& field, const nerf::RenderOptions& rendering) {
    nerf::Renderer renderer(field, rendering);
    renderer.set_recolour(fine);
    return MarkPsnrMeter(field, {.count = 4, .side = 16})(renderer);
  };
  CHECK(mark_psnr(several, mark_psnr_rendering()) == mark_psnr(single, {}));
  CHECK(std::abs(mark_psnr(several, {}) - mark_psnr(single, {})) > 0.1);
}

TEST_CASE("mark_psnr_meter: infinity where nothing differs, and the same for any number of threads") {
  const Owner owner = tiny_owner();
  const MarkPsnrMeter meter(owner.field, {.count = 3});
  nerf::Renderer renderer(owner.field);
  CHECK(std::isinf(meter(renderer)));
  renderer.set_recolour(darker_by(0.02f));
  const ScopedThreads serial(1);
  const double one = meter(renderer);
  const ScopedThreads parallel(2);
  CHECK(meter(renderer) == one);
}

TEST_CASE("mark_psnr_meter: no views and no pixels are refused") {
  const Owner owner = tiny_owner();
  CHECK_THROWS_AS(MarkPsnrMeter(owner.field, {.count = 0}), ValueError);
  CHECK_THROWS_WITH(MarkPsnrMeter(owner.field, {.count = 0}),
                    "[mark_psnr_meter] count and side must be at least 1, got 0 and 80");
  CHECK_THROWS_WITH(MarkPsnrMeter(owner.field, {.side = 0}),
                    "[mark_psnr_meter] count and side must be at least 1, got 256 and 0");
}
