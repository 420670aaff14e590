#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/evaluation.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

namespace fieldmark::nerf {
namespace {

constexpr Index kSsimWindow = 11;

// [H, W], above 0.5 on the foreground.
Tensor<float> foreground_mask(const View& view, const Rendering& rendering) {
  Tensor<float> alpha({view.rgba.shape[0], view.rgba.shape[1]});
  for (Index i = 0; i < alpha.size(); ++i) alpha[i] = view.rgba[4 * i + 3];
  const bool opaque = std::all_of(alpha.data.begin(), alpha.data.end(), [](float a) { return a >= 1; });
  return opaque ? rendering.opacity : alpha;
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

}  // namespace

Evaluation evaluate(Renderer& renderer, const Dataset& dataset,
                    const std::function<bool(Index done, Index total)>& progress, const Lpips<float>* lpips) {
  using Clock = std::chrono::steady_clock;
  if (dataset.views.empty()) throw ValueError("[evaluate] dataset must have at least one view, got 0");
  Evaluation result;
  double seconds = 0;
  for (const View& view : dataset.views) {
    const auto start = Clock::now();
    const Rendering rendering = renderer.render(view.camera);
    seconds += std::chrono::duration<double>(Clock::now() - start).count();
    const Tensor<float> truth = composited(view, dataset.background);
    const Index side = std::min(view.camera.width, view.camera.height);
    const double none = std::numeric_limits<double>::quiet_NaN();
    result.per_view.push_back(
        {.psnr = psnr(rendering.rgb, truth),
         .psnr_foreground = psnr_masked(rendering.rgb, truth, foreground_mask(view, rendering)),
         .ssim = side >= kSsimWindow ? ssim(rendering.rgb, truth) : none,
         .lpips = lpips && side >= lpips->smallest()
                      ? lpips->distance(quantize8(rendering.rgb), quantize8(truth)).value
                      : none});
    ++result.views;
    if (progress && !progress(result.views, static_cast<Index>(dataset.views.size()))) break;
  }
  result.psnr = mean(result.per_view, &ViewScore::psnr);
  result.psnr_foreground = mean(result.per_view, &ViewScore::psnr_foreground);
  result.ssim = mean(result.per_view, &ViewScore::ssim);
  result.lpips = mean(result.per_view, &ViewScore::lpips);
  result.seconds_per_view = seconds / static_cast<double>(result.views);
  return result;
}

}  // namespace fieldmark::nerf
