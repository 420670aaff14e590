#include <fieldmark/distort/affine_warp.h>
#include <fieldmark/distort/resize_area.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/extractor/evidence_pool.h>
#include <fieldmark/watermark/mark/cell_mark.h>
#include <fieldmark/watermark/mark/flatness.h>
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/mark/power_budget.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "optional_term.h"

// Training of a CellMark: local messages under dense supervision.
namespace fieldmark::watermark {
namespace {

constexpr Index kCoarse = 8;                    // pixels per side that the eye averages at a glance
constexpr double kReadable = 0.7, kSafe = 0.8;  // shares of correct signs between which hiding phases in
constexpr float kBitScale = 6;                  // scales pooled evidence, which lies in [-1, 1], to a logit

// Returns [cells, bits] with the sign of each cell in the column of its bit, 0 elsewhere.
std::span<const float> code_matrix(Tape<float>& tape, const CellCode& code, Index bits) {
  const Index cells = std::ssize(code.bit);
  float* matrix = tape.scratch(cells * bits);
  std::fill_n(matrix, cells * bits, 0.f);
  for (Index c = 0; c < cells; ++c)
    if (code.bit[at(c)] >= 0) matrix[c * bits + code.bit[at(c)]] = static_cast<float>(code.sign[at(c)]);
  return {matrix, at(cells * bits)};
}

// Returns by how much |x| exceeds a bound, 0 within it.
Var<float> beyond(Var<float> x, double bound) {
  float* table = x.tape().scratch(x.shape().size());
  std::fill_n(table, x.shape().size(), static_cast<float>(-bound));
  const Var<float> below = x.tape().constant(table, x.shape());
  return add(relu(add(x, below)), relu(sub(below, x)));
}

class CellTraining : public MarkTraining {
 public:
  CellTraining(const CellMark& mark, const Owner& owner, std::span<const CachedView> views);
  Var<float> loss(Tape<float>& tape, const Params<float>& params, std::span<const TrainingImage> images,
                  const TrainingFigures& running, TrainingFigures& figures) override;
  MuonWeights matrices() const override {
    return {{"extractor/*conv/weight", "extractor/index_hidden/weight"}, options_.matrix_rate};
  }
  Var<float> reading_loss(const Params<float>& params, Var<float> marked, const TrainingImage& image,
                          TrainingFigures& figures) const override;
  std::string note(const TrainingFigures& f) const override;
  void describe(RunFingerprint& f) const override;

 private:
  double target(const TrainingImage& image) const {
    return residual_rms(options_, owner_.options().mark_psnr, image.step);
  }
  Tensor<std::int32_t> labels_at(const TrainingImage& image, const Shape& shape, Index height,
                                 Index width) const;
  Var<float> residual(Tape<float>& tape, const Params<float>& params, const TrainingImage& image) const;
  Var<float> visibility(Var<float> residual, const TrainingImage& image, double right) const;

  const CellMark& mark_;
  const CellTrainingOptions& options_;
  const Owner& owner_;
  std::span<const CachedView> views_;
  std::vector<Tensor<std::int32_t>> labels_;    // cell of every pixel of every view; count() is background
  std::vector<std::vector<float>> foreground_;  // of every view
  std::vector<std::vector<float>> flat_;        // [pixels, 3] of every view
};

CellTraining::CellTraining(const CellMark& mark, const Owner& owner, std::span<const CachedView> views)
    : mark_(mark), options_(mark.options().training), owner_(owner), views_(views) {
  const Index cells = owner.cells.count();
  for (const CachedView& v : views) {
    const std::vector<float>& foreground = foreground_.emplace_back(foreground_mask(v));
    Tensor<std::int32_t> label({v.height, v.width}, static_cast<std::int32_t>(cells));
    for (Index p = 0; p < label.size(); ++p) {
      if (foreground[at(p)] == 0) continue;
      const std::int32_t cell = owner.cells.at(&v.position[at(3 * Index{v.sample_begin[at(p)]})]);
      if (cell >= 0) label[p] = cell;
    }
    labels_.push_back(std::move(label));
    flat_.push_back(flatness(v, foreground));
  }
}

// Returns the change of the image [pixels, 3]: the residual of the cached samples, at the step's power.
Var<float> CellTraining::residual(Tape<float>& tape, const Params<float>& params,
                                  const TrainingImage& image) const {
  const CachedView& v = views_[at(image.view)];
  const Index samples = static_cast<Index>(v.weight.size());
  float* weight = tape.scratch(samples);
  owner_.cells.blend(image.signs, image.positions, samples, weight);
  for (Index k = 0; k < samples; ++k) weight[k] *= v.weight[at(k)];
  const Var<float> carrier = mark_.carrier(params, tape.constant(image.positions, {samples, 3}),
                                           tape.constant(v.colour.data(), {samples, 3}));
  return power_budget<float>(
      weighted_segments<float>(carrier, v.sample_begin, std::span<const float>(weight, at(samples))),
      foreground_[at(image.view)], target(image));
}

// Returns the shares of the residual's power that the eye would see: the power that remains after averaging,
// the power on flat areas, and the power of specks beyond a few times the RMS. The first two are about 1 for
// a mark that does not adapt. Without the third, all power would crowd into the few pixels of a plain object
// that are not flat.
Var<float> CellTraining::visibility(Var<float> residual, const TrainingImage& image, double right) const {
  Tape<float>& tape = residual.tape();
  const CachedView& v = views_[at(image.view)];
  const std::vector<float>& foreground = foreground_[at(image.view)];
  const double rms = target(image);
  const auto power = [&](Var<float> x, std::span<const float> weights) {
    float* zeros = tape.scratch(x.shape().size());
    std::fill_n(zeros, x.shape().size(), 0.f);
    return term_or_zero(x, weights, [&] {
      return scale(mse_loss<float>(x, tape.constant(zeros, x.shape()), weights), 1 / (rms * rms));
    });
  };
  const Var<float> coarse = avg_pool(tape.reshape(residual, {1, v.height, v.width, 3}), kCoarse);
  const Index places = coarse.shape().size() / 3, columns = coarse.shape()[2];
  float* weights = tape.scratch(3 * places);
  for (Index i = 0; i < places; ++i) {
    float sum = 0;
    for (Index j = 0; j < kCoarse * kCoarse; ++j)
      sum += foreground[at((i / columns * kCoarse + j / kCoarse) * v.width + i % columns * kCoarse +
                           j % kCoarse)];
    std::fill_n(weights + 3 * i, 3, sum);
  }
  float* whole = tape.scratch(residual.shape().size());
  for (Index i = 0; i < residual.shape().size(); ++i) whole[i] = foreground[at(i / 3)];
  const double ramp = std::clamp((right - kReadable) / (kSafe - kReadable), 0.0, 1.0);
  const Var<float> seen = add(scale(power(coarse, {weights, at(3 * places)}), ramp * options_.smooth_weight),
                              scale(power(residual, flat_[at(image.view)]), ramp * options_.flat_weight));
  return add(seen, scale(power(beyond(residual, options_.peak * rms), {whole, at(residual.shape().size())}),
                         ramp * options_.peak_weight));
}

// Returns the labels of the extractor's places, which move with the pixels of the distorted image.
Tensor<std::int32_t> CellTraining::labels_at(const TrainingImage& image, const Shape& shape, Index height,
                                             Index width) const {
  Tensor<std::int32_t> labels = labels_[at(image.view)];
  if (image.warped)
    labels = distort::warp_labels(labels, image.warp, static_cast<std::int32_t>(owner_.cells.count()),
                                  shape[0], shape[1]);
  return distort::resize_labels(labels, height, width);
}

Var<float> CellTraining::reading_loss(const Params<float>& params, Var<float> marked,
                                      const TrainingImage& image, TrainingFigures& figures) const {
  Tape<float>& tape = marked.tape();
  const CachedView& view = views_[at(image.view)];
  const Var<float> seen = image.distort(tape.reshape(marked, {view.height, view.width, 3}));
  const auto out = mark_.reader()(params, tape.reshape(seen, {1, seen.shape()[0], seen.shape()[1], 3}));

  const Index places = out.height * out.width, classes = owner_.cells.count() + 1,
              bits = owner_.options().bits;
  const Tensor<std::int32_t> labels = labels_at(image, seen.shape(), out.height, out.width);
  auto* label = tape.scratch<std::int32_t>(places);
  float *positive = tape.scratch(places), *foreground = tape.scratch(places), *sent = tape.scratch(bits);
  std::copy(labels.data.begin(), labels.data.end(), label);
  std::copy(image.message.bits.begin(), image.message.bits.end(), sent);
  for (Index i = 0; i < places; ++i) {
    const std::int8_t sign = label[i] + 1 < classes ? image.signs[at(label[i])] : std::int8_t{0};
    positive[i] = sign > 0 ? 1.f : 0.f;
    foreground[i] = sign != 0 ? 1.f : 0.f;
  }
  const Var<float> pooled =
      scale(extractor::pooled_bits<float>(out.sign, out.index, code_matrix(tape, image.code, bits), bits),
            kBitScale);
  const auto all = [](const auto* from, Index n) { return std::span(from, at(n)); };
  const Var<float> sign_loss = term_or_zero(out.sign, all(foreground, places), [&] {
    return bce_with_logits<float>(out.sign, all(positive, places), all(foreground, places));
  });
  const Var<float> index_loss = softmax_cross_entropy<float>(out.index, all(label, places));
  const Var<float> bits_loss = bce_with_logits<float>(pooled, all(sent, bits));

  double sign = 0, index = 0, shown = 0, right = 0;
  for (Index i = 0; i < places; ++i) {
    if (foreground[i] == 0) continue;
    const float* q = out.index.value() + i * classes;
    shown += 1;
    sign += (out.sign.value()[i] > 0) == (positive[i] > 0);
    index += std::none_of(q, q + classes, [most = q[label[i]]](float other) { return other > most; });
  }
  for (Index b = 0; b < bits; ++b) right += (pooled.value()[b] > 0) == (sent[b] > 0);
  figures = {.sign = shown > 0 ? sign / shown : 0,
             .index = shown > 0 ? index / shown : 0,
             .bits = right / static_cast<double>(bits)};
  return add(scale(sign_loss, options_.sign_weight),
             add(scale(index_loss, options_.index_weight), scale(bits_loss, options_.bits_weight)));
}

Var<float> CellTraining::loss(Tape<float>& tape, const Params<float>& params,
                              std::span<const TrainingImage> images, const TrainingFigures& running,
                              TrainingFigures& figures) {
  const TrainingImage& image = images.front();
  const CachedView& view = views_[at(image.view)];
  const Var<float> added = residual(tape, params, image);
  const Var<float> marked = add(tape.constant(view.base.data.data(), {view.height * view.width, 3}), added);
  const Var<float> reading = reading_loss(params, marked, image, figures);
  return add(reading, visibility(added, image, running.sign));
}

std::string CellTraining::note(const TrainingFigures& f) const {
  char note[96];
  std::snprintf(note, sizeof note, "right: sign %.1f%%  cell %.1f%%  bits %.1f%%", 100 * f.sign,
                100 * f.index, 100 * f.bits);
  return note;
}

void CellTraining::describe(RunFingerprint& f) const {
  f.option("mark_psnr", owner_.options().mark_psnr);
  for (const auto& [name, value] : {std::pair{"first_mark_psnr", options_.first_mark_psnr},
                                    {"anneal", options_.anneal},
                                    {"sign_weight", options_.sign_weight},
                                    {"index_weight", options_.index_weight},
                                    {"bits_weight", options_.bits_weight},
                                    {"smooth_weight", options_.smooth_weight},
                                    {"flat_weight", options_.flat_weight},
                                    {"peak", options_.peak},
                                    {"peak_weight", options_.peak_weight},
                                    {"matrix_rate", options_.matrix_rate}})
    f.option(name, value);
}

}  // namespace

std::unique_ptr<MarkTraining> CellMark::training(const Owner& owner,
                                                 std::span<const CachedView> views) const {
  return std::make_unique<CellTraining>(*this, owner, views);
}

}  // namespace fieldmark::watermark
