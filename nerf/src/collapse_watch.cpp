#include <fieldmark/nerf/collapse_watch.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace fieldmark::nerf {
namespace {

constexpr Index kSmallSide = 20;         // pixels of the longer side of the views
constexpr double kLeastVariance = 1e-5;  // of images: below it, any field may fit worse than their mean
constexpr Index kPeriod = 128;           // steps between two looks at a hash field, early on
constexpr Index kEarly = 1024;           // steps after which looks become rare
constexpr Index kRarer = 4;              // times rarer then; mlp fields always, since their rays cost more
constexpr double kSeconds = 1.5;         // between two looks at a hash field, if its steps are slow
constexpr Index kLeastSteps = 24;        // between two looks: a field must have had a chance to learn
constexpr double kRising = 0.02;         // rise of explained() by which a field counts as still learning

std::string worse_than_constant(double explained) {
  char text[120];
  std::snprintf(text, sizeof text,
                "the mean square error of rendered views is %.2f times that of a constant image",
                1 - explained);
  return text;
}

}  // namespace

CollapseWatch::CollapseWatch(const RadianceField& field, const Dataset& images)
    : field_(field), renderer_(field, {.finer = 1, .supersampling = 1}) {
  std::array<double, 3> sum{}, square{};
  Index pixels = 0;
  for (const View& view : images.views) {
    if (std::ssize(truths_) == kViews) break;
    const Tensor<float> image = composited(view, images.background);
    const Index longer = std::max(view.camera.width, view.camera.height);
    Truth truth{.camera = view.camera.scaled(std::min<Index>(kSmallSide, longer)), .rgb = {}};
    const Index width = truth.camera.width, height = truth.camera.height;
    // Takes the pixels nearest to those of the small view: a ray sees their colours, not means.
    for (Index y = 0; y < height; ++y)
      for (Index x = 0; x < width; ++x) {
        const Index u = (2 * x + 1) * view.camera.width / (2 * width),
                    v = (2 * y + 1) * view.camera.height / (2 * height);
        for (Index k = 0; k < 3; ++k) {
          const float c = image[3 * (v * view.camera.width + u) + k];
          truth.rgb.push_back(c);
          sum[at(k)] += static_cast<double>(c);
          square[at(k)] += static_cast<double>(c) * static_cast<double>(c);
        }
      }
    pixels += width * height;
    truths_.push_back(std::move(truth));
  }
  for (std::size_t k = 0; k < 3 && pixels > 0; ++k) {
    const double n = static_cast<double>(pixels);
    variance_ += (square[k] - sum[k] * sum[k] / n) / (3 * n);
  }
}

double CollapseWatch::explained() {
  double error = 0;
  std::size_t channels = 0;
  for (const Truth& truth : truths_) {
    const Rendering seen = renderer_.render(truth.camera);
    for (std::size_t i = 0; i < truth.rgb.size(); ++i) {
      const double e = static_cast<double>(seen.rgb.data[i] - truth.rgb[i]);
      error += e * e;
    }
    channels += truth.rgb.size();
  }
  return 1 - error / (static_cast<double>(channels) * variance_);
}

std::string CollapseWatch::look(Index steps, double train_psnr, double seconds) {
  if (steps > 0 && !std::isfinite(train_psnr)) return "the loss is not a number";
  if (std::isnan(looked_at_)) looked_at_ = seconds;
  const Index period = field_.coarse || steps > kEarly ? kRarer * kPeriod : kPeriod;
  const bool slow = !field_.coarse && seconds - looked_at_ >= kSeconds && steps - looked_ >= kLeastSteps;
  if (steps > 0 && !slow && (steps % period != 0 || steps == looked_)) return {};
  looked_ = steps;
  looked_at_ = seconds;
  if (field_.grid.occupied_cells() == 0) return "no cell of the scene is occupied";
  if (steps == 0 || !(variance_ > kLeastVariance)) return {};
  const double now = explained();
  worse_ = now > 0 || (worse_ > 0 && now > last_ + kRising) ? 0 : worse_ + 1;
  last_ = now;
  return worse_ < kPatience ? "" : worse_than_constant(now);
}

std::string CollapseWatch::verdict(Index steps) {
  if (steps < kPatience * kPeriod * (field_.coarse ? kRarer : 1) || !(variance_ > kLeastVariance)) return {};
  const double now = explained();
  return now > 0 ? "" : worse_than_constant(now);
}

}  // namespace fieldmark::nerf
