#include <fieldmark/core/error.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/watermark/embedding/mark_psnr_meter.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <fieldmark/imaging/means.h>

namespace fieldmark::watermark {

MarkPsnrMeter::MarkPsnrMeter(const nerf::RadianceField& unmarked, const MarkPsnrViews& views) {
  if (views.count < 1 || views.side < 1)
    throw ValueError("[mark_psnr_meter] count and side must be at least 1, got " +
                     std::to_string(views.count) + " and " + std::to_string(views.side));
  const nerf::CameraSpan& span = unmarked.cameras;
  cameras_ = nerf::make_cameras(span, nerf::CameraSet::novel, views.count,
                                std::min(views.side, std::max(span.width, span.height)), views.seed);
  nerf::Renderer renderer(unmarked, mark_psnr_rendering());
  for (const nerf::Camera& camera : cameras_) unmarked_.push_back(renderer.render(camera));
}

double MarkPsnrMeter::operator()(nerf::Renderer& marked, const std::function<void(Index view)>& before,
                                 Index every) const {
  std::vector<double> psnr;
  for (std::size_t i = 0; i < cameras_.size(); i += static_cast<std::size_t>(every)) {
    if (before) before(static_cast<Index>(i));
    const nerf::Rendering& plain = unmarked_[i];
    psnr.push_back(psnr_masked(marked.render(cameras_[i]).rgb, plain.rgb, plain.opacity));
  }
  const double mean = finite_mean(psnr);
  return std::isnan(mean) ? std::numeric_limits<double>::infinity() : mean;
}

}  // namespace fieldmark::watermark
