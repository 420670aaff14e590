#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/colour_fit.h>
#include <fieldmark/nerf/evaluation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kSsimWindow = 11;
constexpr Index kMostPixels = 1 << 23;  // of views that are scored at a time

// Returns [H, W], above 0.5 on the foreground.
Tensor<float> foreground_mask(const View& view, const Rendering& rendering) {
  Tensor<float> alpha({view.rgba.shape[0], view.rgba.shape[1]});
  for (Index i = 0; i < alpha.size(); ++i) alpha[i] = view.rgba[4 * i + 3];
  const bool opaque = std::all_of(alpha.data.begin(), alpha.data.end(), [](float a) { return a >= 1; });
  return opaque ? rendering.opacity : alpha;
}

// Returns [H, W], 1 on valid pixels; empty: all are valid.
Tensor<float> valid_mask(const View& view) {
  if (view.valid.empty()) return {};
  Tensor<float> mask({view.rgba.shape[0], view.rgba.shape[1]});
  for (Index i = 0; i < mask.size(); ++i) mask[i] = view.valid[at(i)] ? 1.f : 0.f;
  return mask;
}

ViewScore score(const View& view, Rendering rendering, Background background, const Lpips<float>* lpips) {
  const Tensor<float> valid = valid_mask(view);
  Tensor<float> truth = composited(view, background);
  Tensor<float> foreground = foreground_mask(view, rendering);
  Tensor<float> fitted = colour_fitted(rendering, view, background);
  for (Index i = 0; i < valid.size(); ++i) {
    if (valid[i] > 0) continue;
    foreground[i] = 0;
    for (Tensor<float>* image : {&truth, &rendering.rgb, &fitted}) std::fill_n(&(*image)[3 * i], 3, 0.f);
  }
  const Index side = std::min(view.camera.width, view.camera.height);
  const double none = std::numeric_limits<double>::quiet_NaN();
  const auto over_valid = [&](const Tensor<float>& image) {
    return view.valid.empty() ? psnr(image, truth) : psnr_masked(image, truth, valid);
  };
  return {.psnr = over_valid(rendering.rgb),
          .psnr_foreground = psnr_masked(rendering.rgb, truth, foreground),
          .psnr_colour_fitted = over_valid(fitted),
          .ssim = side >= kSsimWindow ? ssim(rendering.rgb, truth) : none,
          .lpips = lpips && side >= lpips->smallest()
                       ? lpips->distance(quantize8(rendering.rgb), quantize8(truth)).value
                       : none};
}

double mean(const std::vector<ViewScore>& scores, double ViewScore::*number) {
  double sum = 0;
  Index count = 0;
  for (const ViewScore& s : scores)
    if (!std::isnan(s.*number)) {
      sum += s.*number;
      ++count;
    }
  return count > 0 ? sum / static_cast<double>(count) : std::numeric_limits<double>::quiet_NaN();
}

// Returns how many views to score at a time, each on one thread. LPIPS uses all threads and much memory.
Index batch_of(const Dataset& dataset, const Lpips<float>* lpips) {
  const Camera& camera = dataset.views.front().camera;
  const Index pixels = std::max<Index>(1, camera.width * camera.height);
  return lpips ? 1 : std::clamp<Index>(kMostPixels / pixels, 1, threads());
}

}  // namespace

Evaluation evaluate(Renderer& renderer, const Dataset& dataset,
                    const std::function<bool(Index done, Index total)>& progress, const Lpips<float>* lpips) {
  using Clock = std::chrono::steady_clock;
  if (dataset.views.empty()) throw ValueError("[evaluate] dataset must have at least one view, got 0");
  Evaluation result;
  double seconds = 0;
  const Index total = std::ssize(dataset.views), batch = batch_of(dataset, lpips);
  for (bool more = true; more && result.views < total;) {
    const std::span views = std::span(dataset.views).subspan(at(result.views));
    std::vector<Rendering> renderings;
    while (more && std::ssize(renderings) < std::min(batch, std::ssize(views))) {
      const View& view = views[renderings.size()];
      const auto start = Clock::now();
      renderings.push_back(renderer.render(view.camera, view.offsets.get()));
      seconds += std::chrono::duration<double>(Clock::now() - start).count();
      ++result.views;
      more = !progress || progress(result.views, total);
    }
    std::vector<ViewScore> scores(renderings.size());
    parallel_for(std::ssize(scores), 1, [&](Index i, Index) {
      scores[at(i)] = score(views[at(i)], std::move(renderings[at(i)]), dataset.background, lpips);
    });
    result.per_view.insert(result.per_view.end(), scores.begin(), scores.end());
  }
  result.psnr = mean(result.per_view, &ViewScore::psnr);
  result.psnr_foreground = mean(result.per_view, &ViewScore::psnr_foreground);
  result.psnr_colour_fitted = mean(result.per_view, &ViewScore::psnr_colour_fitted);
  result.ssim = mean(result.per_view, &ViewScore::ssim);
  result.lpips = mean(result.per_view, &ViewScore::lpips);
  result.seconds_per_view = seconds / static_cast<double>(result.views);
  return result;
}

}  // namespace fieldmark::nerf
