#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/attacks/attack_meter.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "readers.h"

namespace fieldmark::watermark {
namespace {

// Interpolates a pixel of [H, W, 3] at (x, y) inside the image or up to half a pixel beyond.
std::array<double, 3> between(const Tensor<float>& image, double x, double y) {
  const Index h = image.shape[0], w = image.shape[1];
  x = std::clamp(x, 0.0, static_cast<double>(w - 1));
  y = std::clamp(y, 0.0, static_cast<double>(h - 1));
  const auto left = static_cast<Index>(x), top = static_cast<Index>(y);
  const Index right = std::min(left + 1, w - 1), bottom = std::min(top + 1, h - 1);
  const double u = x - static_cast<double>(left), v = y - static_cast<double>(top);
  std::array<double, 3> out;
  for (Index c = 0; c < 3; ++c) {
    const auto at = [&](Index row, Index column) {
      return static_cast<double>(image[3 * (row * w + column) + c]);
    };
    out[static_cast<std::size_t>(c)] = (1 - v) * ((1 - u) * at(top, left) + u * at(top, right)) +
                                       v * ((1 - u) * at(bottom, left) + u * at(bottom, right));
  }
  return out;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  // Takes the geometric mean of the two middle p-values, because they span many powers of ten.
  return n % 2 ? values[n / 2] : std::sqrt(values[n / 2 - 1]) * std::sqrt(values[n / 2]);
}

}  // namespace

AttackDamage attack_damage(const Tensor<float>& before, const Tensor<float>& opacity,
                           const Tensor<float>& after, const distort::PixelMap& source) {
  check_rank("attack_damage", "before", before.shape, 3, "[height, width, 3]");
  check_rank("attack_damage", "after", after.shape, 3, "[height, width, 3]");
  check_extent("attack_damage", "before", before.shape, 2, 3, "red, green and blue");
  check_extent("attack_damage", "after", after.shape, 2, 3, "red, green and blue");
  const Index h = before.shape[0], w = before.shape[1];
  if (opacity.shape != Shape{h, w})
    throw ShapeError("[attack_damage] opacity must have a number for each pixel of before, " +
                     before.shape.str() + ", got shape " + opacity.shape.str());
  const distort::PixelMap to = source.inverse();
  const double right = static_cast<double>(after.shape[1]) - 0.5,
               bottom = static_cast<double>(after.shape[0]) - 0.5;
  double object = 0, shown = 0, squares = 0;
  for (Index p = 0; p < h * w; ++p) {
    if (!(opacity[p] > 0.5f)) continue;
    object += 1;
    const auto column = static_cast<double>(p % w), row = static_cast<double>(p / w);
    const auto place = to(column, row);
    if (!source.keeps(column, row)) continue;
    if (place[0] < -0.5 || place[1] < -0.5 || place[0] > right || place[1] > bottom) continue;
    shown += 1;
    const auto found = between(after, place[0], place[1]);
    for (Index c = 0; c < 3; ++c)
      squares += std::pow(found[static_cast<std::size_t>(c)] - static_cast<double>(before[3 * p + c]), 2);
  }
  return {.psnr = shown > 0 ? -10 * std::log10(squares / (3 * shown)) : std::nan(""), .kept = shown / object};
}

// Collects the results of all views under one attack.
class AttackMeter::Row {
 public:
  Row(const AttackMeter& meter, std::string name) : meter_(meter) { row_.name = std::move(name); }
  void add(const Tensor<float>& view_image, const AttackDamage& damage) {
    const Index view = std::ssize(accuracy_.blind), all = std::ssize(meter_.views_);
    accuracy_.add(read(view_image, view < meter_.informed_views()));
    damage_.push_back(damage.psnr);
    kept_.push_back(damage.kept);
    if ((view + 1) % std::min(meter_.options_.group, all) == 0) {
      p_values_.push_back(keyed_p_value(keyed_statistic(sum_, meter_.code_, meter_.message_)));
      std::ranges::fill(sum_, 0.0);
    }
    meter_.tell(static_cast<std::size_t>(view + 1));
  }
  AttackRow finish() {
    row_.accuracy = accuracy_.mean();
    row_.accuracy_p5 = percentile_5(accuracy_.blind);
    row_.p_value = median(p_values_);
    row_.psnr_foreground = finite_mean(damage_);
    row_.kept = finite_mean(kept_);
    return row_;
  }

 private:
  // Images too small to read count as unreadable: accuracy 0.5 and no evidence.
  ReadingAccuracy read(const Tensor<float>& view_image, bool with_informed) {
    try {
      return meter_.readers_->read(view_image, meter_.message_, with_informed, [this](const auto& evidence) {
        for (std::size_t c = 0; c < sum_.size(); ++c) sum_[c] += evidence[c];
      });
    } catch (const ShapeError&) {
      const double none = with_informed ? 0.5 : std::nan("");
      const bool counts = with_informed || !meter_.readers_->informed();
      return {.blind = 0.5, .informed = none, .chosen = none, .found = counts ? 0 : std::nan("")};
    }
  }

  const AttackMeter& meter_;
  AttackRow row_;
  Accuracies accuracy_;
  std::vector<double> damage_, kept_, p_values_, sum_ = std::vector<double>(meter_.code_.bit.size(), 0.0);
};

AttackMeter::AttackMeter(const Owner& owner, const nerf::RadianceField& marked, const Message& message,
                         const AttackMeterOptions& options)
    : owner_(owner), message_(message), options_(options), code_(owner.code()) {
  if (options.cameras.empty()) throw ValueError("[attack_meter] cameras must not be empty");
  if (options.group < 1)
    throw ValueError("[attack_meter] group must be at least 1, got " + std::to_string(options.group));
  if (message.size() != owner.options().bits)
    throw ValueError("[attack_meter] message must have the owner's " + std::to_string(owner.options().bits) +
                     " bits, got " + std::to_string(message.size()));
  if (options.informed_views < 0)
    throw ValueError("[attack_meter] informed_views must not be negative, got " +
                     std::to_string(options.informed_views));
  readers_ = std::make_unique<Readers>(owner, code_, options.informed_views > 0);
  nerf::Renderer renderer(marked);
  for (const nerf::Camera& camera : options_.cameras) {
    nerf::Rendering r = renderer.render(camera);
    views_.push_back({quantize8(r.rgb), std::move(r.opacity)});
    tell(views_.size());
  }
}

AttackMeter::~AttackMeter() = default;

Index AttackMeter::informed_views() const {
  return readers_->informed() ? std::min(options_.informed_views, std::ssize(options_.cameras)) : 0;
}

void AttackMeter::tell(std::size_t done) const {
  if (options_.progress && !options_.progress(static_cast<Index>(done), std::ssize(options_.cameras)))
    throw Error("stopped while measuring attacks");
}

AttackRow AttackMeter::none() const {
  Row row(*this, "none");
  for (const View& v : views_) row.add(v.rgb, {std::numeric_limits<double>::infinity(), 1});
  return row.finish();
}

AttackRow AttackMeter::image(const std::string& name) const {
  const distort::Distortion attack = distort::parse_distortion(name);
  const CounterRng rng(options_.seed, 42);
  const float level = nerf::background_value(owner_.field.background);
  const float background[3] = {level, level, level};
  Row row(*this, name);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    distort::PixelMap source;
    const Tensor<float> after = distort::apply_distortion(attack, views_[i].rgb, rng, i, background, &source);
    row.add(after, attack_damage(views_[i].rgb, views_[i].opacity, after, source));
  }
  return row.finish();
}

AttackRow AttackMeter::field(const std::string& name, const nerf::RadianceField& attacked,
                             const nerf::RadianceField* reference) const {
  nerf::Renderer renderer(attacked), base(reference ? *reference : attacked);
  Row row(*this, name);
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const Tensor<float> after = quantize8(renderer.render(options_.cameras[i]).rgb);
    if (reference) {
      const nerf::Rendering before = base.render(options_.cameras[i]);
      row.add(after, attack_damage(quantize8(before.rgb), before.opacity, after, {}));
    } else {
      row.add(after, attack_damage(views_[i].rgb, views_[i].opacity, after, {}));
    }
  }
  return row.finish();
}

}  // namespace fieldmark::watermark
