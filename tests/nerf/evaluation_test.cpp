#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/colour_fit.h>
#include <fieldmark/nerf/evaluation.h>

#include <algorithm>
#include <cmath>

#include "small_field.h"
#include "support/catch.h"
#include "support/random_weights.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
// Returns images of the field itself, with its opacity as alpha, brightened by `error`.
Dataset images(const RadianceField& field, int views, float error, Index height = 16) {
  Dataset data{.name = "self", .split = "test", .background = field.background, .views = {}};
  Renderer renderer(field);
  for (int v = 0; v < views; ++v) {
    const Camera camera = make_camera(look_at({3.0 - v, -3, 1.5}, {0, 0, 0}, {0, 0, 1}), 0.9, 20, height);
    const Rendering r = renderer.render(camera);
    View view{.camera = camera, .rgba = Tensor<float>(Shape{height, 20, 4}, 1.f), .name = "v"};
    for (Index i = 0; i < height * 20; ++i) {
      const float a = r.opacity[i];
      for (Index k = 0; k < 3; ++k) {
        const float straight = a > 0 ? (r.rgb[3 * i + k] - (1 - a)) / a : 0.f;
        view.rgba[4 * i + k] = std::min(std::max(straight + error, 0.f), 1.f);
      }
      view.rgba[4 * i + 3] = a;
    }
    data.views.push_back(view);
  }
  return data;
}
}  // namespace

TEST_CASE("evaluation: training images of the field itself are nearly perfect") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  const Evaluation e = evaluate(renderer, images(field, 3, 0));
  CHECK(e.views == 3);
  CHECK(e.per_view.size() == 3);
  CHECK(e.psnr > 48);  // differs by at most a rounding step of 1/255
  CHECK(e.ssim > 0.999);
  CHECK(e.seconds_per_view > 0);
}

TEST_CASE("evaluation: scores are those of the metrics, and means are over the views") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  const Dataset data = images(field, 3, 0.1f);
  const Evaluation e = evaluate(renderer, data);
  double sum[3] = {0, 0, 0};
  for (std::size_t v = 0; v < 3; ++v) {
    const Rendering r = renderer.render(data.views[v].camera);
    const Tensor<float> truth = composited(data.views[v], data.background);
    Tensor<float> mask(Shape{16, 20});
    for (Index i = 0; i < 320; ++i) mask[i] = data.views[v].rgba[4 * i + 3];
    CHECK(e.per_view[v].psnr == psnr(r.rgb, truth));
    CHECK(e.per_view[v].psnr_foreground == psnr_masked(r.rgb, truth, mask));
    CHECK(e.per_view[v].psnr_colour_fitted == psnr(colour_fitted(r, data.views[v], data.background), truth));
    CHECK(e.per_view[v].psnr_colour_fitted > e.per_view[v].psnr + 3);
    CHECK(e.per_view[v].ssim == ssim(r.rgb, truth));
    sum[0] += e.per_view[v].psnr, sum[1] += e.per_view[v].psnr_foreground, sum[2] += e.per_view[v].ssim;
  }
  CHECK(std::abs(e.psnr - sum[0] / 3) < 1e-12);
  CHECK(std::abs(e.psnr_foreground - sum[1] / 3) < 1e-12);
  CHECK(std::abs(e.ssim - sum[2] / 3) < 1e-12);
  CHECK(e.psnr_foreground < e.psnr);
}

TEST_CASE(
    "evaluation: LPIPS of images rounded to 8 bits where there is a network and they are large enough") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  const Dataset data = images(field, 2, 0.1f, 18);
  const Lpips<float> lpips(random_weights(lpips_tensors(LpipsNetwork::squeeze)), LpipsNetwork::squeeze);
  const Evaluation e = evaluate(renderer, data, {}, &lpips);
  double sum = 0;
  for (std::size_t v = 0; v < 2; ++v) {
    const Tensor<float> rendered = quantize8(renderer.render(data.views[v].camera).rgb),
                        truth = quantize8(composited(data.views[v], data.background));
    CHECK(e.per_view[v].lpips == lpips.distance(rendered, truth).value);
    CHECK(e.per_view[v].lpips > 0);
    sum += e.per_view[v].lpips;
  }
  CHECK(e.lpips == Approx(sum / 2).epsilon(1e-12));
  CHECK(std::isnan(evaluate(renderer, data).lpips));
  CHECK(std::isnan(evaluate(renderer, images(field, 1, 0.1f), {}, &lpips).lpips));  // 16 rows: too few
}

TEST_CASE("evaluation: pixels that are not valid count in no PSNR") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  Dataset data = images(field, 2, 0.1f), wrong = data;
  const Evaluation whole = evaluate(renderer, data);
  for (std::size_t v = 0; v < 2; ++v) {
    data.views[v].valid.assign(320, 1);
    for (Index i = 0; i < 320; ++i)
      if (i % 20 < 8) {
        data.views[v].valid[static_cast<std::size_t>(i)] = 0;
        for (Index k = 0; k < 3; ++k) wrong.views[v].rgba[4 * i + k] = 1 - wrong.views[v].rgba[4 * i + k];
      }
    wrong.views[v].valid = data.views[v].valid;
  }
  const Evaluation masked = evaluate(renderer, data), other = evaluate(renderer, wrong);
  CHECK(masked.psnr == other.psnr);
  CHECK(masked.psnr_foreground == other.psnr_foreground);
  CHECK(masked.psnr_colour_fitted == other.psnr_colour_fitted);
  CHECK(masked.psnr != whole.psnr);
  const Rendering r = renderer.render(data.views[0].camera);
  Tensor<float> mask(Shape{16, 20});
  for (Index i = 0; i < 320; ++i) mask[i] = i % 20 < 8 ? 0.f : 1.f;
  CHECK(masked.per_view[0].psnr == psnr_masked(r.rgb, composited(data.views[0], data.background), mask));
  CHECK(masked.ssim == other.ssim);
  CHECK(masked.ssim != whole.ssim);
  for (View& v : data.views) std::fill(v.valid.begin(), v.valid.end(), std::uint8_t{1});
  CHECK(evaluate(renderer, data).psnr == whole.psnr);
}

TEST_CASE("evaluation: without alpha the object is where the rendering is opaque") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  Dataset data = images(field, 1, 0);
  const Tensor<float> before = composited(data.views[0], data.background);
  for (Index i = 0; i < 320; ++i) {
    for (Index k = 0; k < 3; ++k) data.views[0].rgba[4 * i + k] = 0.9f * before[3 * i + k];
    data.views[0].rgba[4 * i + 3] = 1;
  }
  const Rendering r = renderer.render(data.views[0].camera);
  const Evaluation e = evaluate(renderer, data);
  CHECK(e.psnr_foreground == psnr_masked(r.rgb, composited(data.views[0], data.background), r.opacity));
}

TEST_CASE("evaluation: a view without the object and a tiny image are left out of their means") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  Dataset data = images(field, 2, 0.1f);
  for (Index i = 0; i < 320; ++i) data.views[1].rgba[4 * i + 3] = 0;
  const Evaluation e = evaluate(renderer, data);
  CHECK(std::isnan(e.per_view[1].psnr_foreground));
  CHECK(e.psnr_foreground == e.per_view[0].psnr_foreground);
  data.views.resize(1);
  data.views[0].camera = data.views[0].camera.scaled(4, 4);
  data.views[0].rgba = Tensor<float>(Shape{4, 4, 4}, 0.5f);
  CHECK(std::isnan(evaluate(renderer, data).ssim));
}

TEST_CASE("evaluation: views are compared at the offsets of their pixels") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  Dataset data{.name = "beside", .split = "test", .background = field.background, .views = {}};
  Camera camera = make_camera(look_at({2.2, -3.1, 1.7}, {0.1, 0.2, 0}, {0, 0, 1}), 0.9, 23, 18);
  const Rendering seen = renderer.render(camera);
  Tensor<float> rgba(Shape{18, 23, 4}, 1.f);
  for (Index i = 0; i < 18 * 23; ++i) std::copy_n(&seen.rgb.data[at(3 * i)], 3, &rgba.data[at(4 * i)]);
  camera.cx += 0.5;
  data.views.push_back({.camera = camera, .rgba = rgba, .name = "a"});
  const double at_centres = evaluate(renderer, data).psnr;
  data.views[0].offsets = std::make_shared<PixelOffsets>(18 * 23, std::array{0.5f, 0.f});
  CHECK(evaluate(renderer, data).psnr > at_centres + 20);
}

TEST_CASE("evaluation: progress counts views and can end it") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  const Dataset data = images(field, 3, 0);
  std::vector<Index> seen;
  const Evaluation e = evaluate(renderer, data, [&](Index done, Index total) {
    CHECK(total == 3);
    seen.push_back(done);
    return done < 2;
  });
  CHECK(seen == std::vector<Index>{1, 2});
  CHECK(e.views == 2);
  CHECK(e.per_view.size() == 2);
}

TEST_CASE(
    "evaluation: many views have the scores of each alone, for any thread count and wherever they end") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  const Dataset data = images(field, 19, 0.1f, 40);
  std::vector<ViewScore> expected;
  for (const View& view : data.views) {
    Dataset alone = data;
    alone.views = {view};
    expected.push_back(evaluate(renderer, alone).per_view.at(0));
  }
  for (const auto& [count, last] : {std::pair{1, 19}, {2, 19}, {4, 19}, {4, 1}, {4, 8}, {4, 9}}) {
    CAPTURE(count, last);
    const ScopedThreads scope(count);
    const Index end = last;
    const Evaluation e = evaluate(renderer, data, [&](Index done, Index) { return done < end; });
    CHECK(e.views == end);
    REQUIRE(std::ssize(e.per_view) == end);
    for (std::size_t v = 0; v < e.per_view.size(); ++v)
      for (const auto number :
           {&ViewScore::psnr, &ViewScore::psnr_foreground, &ViewScore::psnr_colour_fitted, &ViewScore::ssim})
        CHECK(e.per_view[v].*number == expected[v].*number);
  }
}

TEST_CASE("evaluation: no views are an error") {
  const RadianceField field = small_field();
  Renderer renderer(field);
  CHECK_THROWS_WITH(evaluate(renderer, Dataset{}), "[evaluate] dataset must have at least one view, got 0");
}
