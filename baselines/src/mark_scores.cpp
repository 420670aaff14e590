#include <fieldmark/baselines/mark_scores.h>
#include <fieldmark/distort/distortion.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/evaluation.h>

#include <algorithm>
#include <chrono>
#include <cmath>

namespace fieldmark::baselines {
namespace {

using Clock = std::chrono::steady_clock;

constexpr Index kWindow = 11;      // of ssim()
constexpr Index kAllMessages = 4;  // number of bits up to which all messages are cycled through

// Mean and deviation of the finite values: equal images have no PSNR, a view of the background no object.
struct Mean {
  double sum = 0, squares = 0, count = 0;
  void add(double v) {
    if (!std::isfinite(v)) return;
    sum += v;
    squares += v * v;
    count += 1;
  }
  double value() const { return count > 0 ? sum / count : std::nan(""); }
  double deviation() const {
    return count > 0 ? std::sqrt(std::max(0.0, squares / count - value() * value())) : std::nan("");
  }
};

double ssim_or_nan(const Tensor<float>& a, const Tensor<float>& b) {
  return std::min(a.shape[0], a.shape[1]) < kWindow ? std::nan("") : ssim(a, b);
}

double lpips_or_nan(const Lpips<float>* lpips, const Tensor<float>& a, const Tensor<float>& b) {
  if (!lpips || std::min(a.shape[0], a.shape[1]) < lpips->smallest()) return std::nan("");
  return lpips->distance(a, b).value;
}

class Scorer {
 public:
  Scorer(const nerf::RadianceField& unmarked, const MarkedScene& marked, const ScoreOptions& options)
      : marked_(marked),
        options_(options),
        plain_(unmarked),
        level_(nerf::background_value(unmarked.background)),
        rng_(options.seed, 42) {
    for (const std::string& name : options.under) attacks_.push_back(distort::parse_distortion(name));
    total_ = options.cameras.size() + (options.ground_truth ? options.ground_truth->views.size() : 0);
  }

  void read_views(MarkScores& scores) {
    Mean accuracy, whole, object, similar, perceptual;
    std::vector<Mean> under(attacks_.size());
    const auto under_views =
        options_.under_views > 0 ? static_cast<std::size_t>(options_.under_views) : options_.cameras.size();
    const Clock::time_point start = Clock::now();
    for (std::size_t i = 0; i < options_.cameras.size(); ++i) {
      if (i >= under_views && options_.seconds > 0 &&
          std::chrono::duration<double>(Clock::now() - start).count() > options_.seconds)
        break;
      scores.views = static_cast<Index>(i) + 1;
      const watermark::Message sent = marked_.message(static_cast<Index>(i));
      const Tensor<float> rendered = quantize8(marked_.render(options_.cameras[i], sent));
      const nerf::Rendering plain = plain_.render(options_.cameras[i]);
      accuracy.add(marked_.accuracy(rendered, sent));
      if (i < under_views) read_under(i, rendered, sent, under);
      const Tensor<float> base = quantize8(plain.rgb);
      whole.add(psnr(rendered, base));
      object.add(psnr_masked(rendered, base, plain.opacity));
      similar.add(ssim_or_nan(rendered, base));
      perceptual.add(lpips_or_nan(options_.lpips, rendered, base));
      tell();
    }
    scores.accuracy = accuracy.value();
    scores.spread = accuracy.deviation();
    scores.psnr_base = whole.value();
    scores.psnr_base_foreground = object.value();
    scores.ssim_base = similar.value();
    scores.lpips_base = perceptual.value();
    for (std::size_t a = 0; a < attacks_.size(); ++a) scores.under[options_.under[a]] = under[a].value();
  }

  void compare_ground_truth(MarkScores& scores) {
    Mean whole, object, similar, perceptual, unmarked;
    Index i = 0;
    const nerf::Dataset none, &ground_truth = options_.ground_truth ? *options_.ground_truth : none;
    for (const nerf::View& view : ground_truth.views) {
      const Tensor<float> truth = nerf::composited(view, ground_truth.background);
      const Tensor<float> rendered = quantize8(marked_.render(view.camera, marked_.message(i++)));
      const nerf::Rendering plain = plain_.render(view.camera);
      whole.add(psnr(rendered, truth));
      object.add(psnr_masked(rendered, truth, plain.opacity));
      similar.add(ssim_or_nan(rendered, truth));
      perceptual.add(lpips_or_nan(options_.lpips, rendered, quantize8(truth)));
      unmarked.add(psnr(plain.rgb, truth));
      tell();
    }
    scores.psnr_gt = whole.value();
    scores.psnr_gt_object = object.value();
    scores.ssim_gt = similar.value();
    scores.lpips_gt = perceptual.value();
    scores.psnr_gt_unmarked = unmarked.value();
  }

 private:
  void read_under(std::size_t i, const Tensor<float>& rendered, const watermark::Message& sent,
                  std::vector<Mean>& under) {
    const float background[3] = {level_, level_, level_};
    for (std::size_t a = 0; a < attacks_.size(); ++a)
      under[a].add(marked_.accuracy(
          distort::apply_distortion(attacks_[a], rendered, rng_, i * attacks_.size() + a, background), sent));
  }

  void tell() {
    ++done_;
    if (options_.progress && !options_.progress(static_cast<double>(done_) / static_cast<double>(total_)))
      throw Error("stopped while a mark was measured");
  }

  const MarkedScene& marked_;
  const ScoreOptions& options_;
  nerf::Renderer plain_;
  float level_;
  CounterRng rng_;
  std::vector<distort::Distortion> attacks_;
  std::size_t done_ = 0, total_ = 0;
};

}  // namespace

watermark::Message message_of_view(Index bits, std::uint64_t seed, Index view) {
  if (bits > kAllMessages)
    return watermark::random_message(bits, CounterRng(seed, 41), static_cast<std::uint64_t>(view));
  watermark::Message message;
  for (Index b = 0; b < bits; ++b) message.bits.push_back(static_cast<std::uint8_t>(view >> b & 1));
  return message;
}

MarkScores score_mark(const nerf::RadianceField& unmarked, const MarkedScene& marked,
                      const ScoreOptions& options) {
  if (options.cameras.empty()) throw ValueError("[score_mark] cameras must not be empty");
  MarkScores scores;
  Scorer scorer(unmarked, marked, options);
  scorer.read_views(scores);
  scorer.compare_ground_truth(scores);
  return scores;
}

}  // namespace fieldmark::baselines
