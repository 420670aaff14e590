#include <fieldmark/distort/affine_warp.h>
#include <fieldmark/distort/resize_area.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/extractor/evidence_pool.h>
#include <fieldmark/watermark/mark/power_budget.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include <algorithm>
#include <cmath>

#include "training_image.h"

// Preset fast: a local message under dense supervision.
namespace fieldmark::watermark {
namespace {

constexpr Index kCoarse = 8;  // pixels a side that eyes average at a glance
constexpr double kReadable = 0.7,
                 kSafe = 0.8;   // shares of right signs between which the mark learns to hide
constexpr float kBitScale = 6;  // pooled evidence lies in [-1, 1]: this makes it a logit

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// How flat the base image is around each pixel of the object: exp(-(s / 0.03)^2), s the standard deviation
// of the green channel in 5 x 5 pixels; the same for the three channels.
std::vector<float> flatness(const CachedView& v, const std::vector<float>& object) {
  std::vector<float> flat(3 * object.size(), 0.f);
  for (Index y = 0; y < v.height; ++y)
    for (Index x = 0; x < v.width; ++x) {
      const Index p = y * v.width + x;
      if (object[at(p)] == 0) continue;
      float sum = 0, squares = 0, n = 0;
      for (Index j = std::max<Index>(y - 2, 0); j <= std::min(y + 2, v.height - 1); ++j)
        for (Index i = std::max<Index>(x - 2, 0); i <= std::min(x + 2, v.width - 1); ++i) {
          const float g = v.base[3 * (j * v.width + i) + 1];
          sum += g;
          squares += g * g;
          n += 1;
        }
      const float variance = std::max(squares / n - (sum / n) * (sum / n), 0.f);
      std::fill_n(&flat[at(3 * p)], 3, std::exp(-variance / (0.03f * 0.03f)));
    }
  return flat;
}

}  // namespace

// What each view says of the cells, and where it is flat.
void Embedder::label_views() {
  const Index cells = owner_.cells.count(), bits = owner_.options().bits;
  code_matrix_.assign(at(cells * bits), 0.f);
  for (Index c = 0; c < cells; ++c)
    if (code_.bit[at(c)] >= 0)
      code_matrix_[at(c * bits + code_.bit[at(c)])] = static_cast<float>(code_.sign[at(c)]);
  for (const CachedView& v : views_) {
    const std::vector<float>& object = object_[labels_.size()];
    Tensor<std::int32_t> label({v.height, v.width}, static_cast<std::int32_t>(cells));
    for (Index p = 0; p < label.size(); ++p) {
      if (object[at(p)] == 0) continue;
      const std::int32_t cell = owner_.cells.at(&v.position[at(3 * Index{v.sample_begin[at(p)]})]);
      if (cell >= 0) label[p] = cell;
    }
    labels_.push_back(std::move(label));
    flat_.push_back(flatness(v, object));
  }
}

// What the mark adds to the image [pixels, 3]: the residual of the cached samples, at the step's power.
Var<float> Embedder::residual(Tape<float>& tape, const Params<float>& params, const Image& p) const {
  const CachedView& v = views_[at(p.view)];
  const Index samples = static_cast<Index>(v.weight.size());
  const float* x = shifted_positions(tape, p);
  float* weight = tape.scratch(samples);
  owner_.cells.blend(p.signs, x, samples, weight);
  for (Index k = 0; k < samples; ++k) weight[k] *= v.weight[at(k)];
  const Var<float> carrier = owner_.mark->carrier(params, tape.constant(x, {samples, 3}),
                                                  tape.constant(v.colour.data(), {samples, 3}));
  return power_budget<float>(
      weighted_segments<float>(carrier, v.sample_begin, std::span<const float>(weight, at(samples))),
      object_[at(p.view)], p.target);
}

// The shares of the residual's power that eyes would see: what is left of it after averaging, and how strong
// it is on flat areas. Both are about 1 for a mark that takes no care.
Var<float> Embedder::visibility(Var<float> residual, const Image& p) const {
  Tape<float>& tape = residual.tape();
  const CachedView& v = views_[at(p.view)];
  const auto power = [&](Var<float> x, std::span<const float> weights) {
    float* zeros = tape.scratch(x.shape().size());
    std::fill_n(zeros, x.shape().size(), 0.f);
    return scale(mse_loss<float>(x, tape.constant(zeros, x.shape()), weights), 1 / (p.target * p.target));
  };
  const Var<float> coarse = avg_pool(tape.reshape(residual, {1, v.height, v.width, 3}), kCoarse);
  const Index places = coarse.shape().size() / 3, columns = coarse.shape()[2];
  float* on_object = tape.scratch(3 * places);
  for (Index i = 0; i < places; ++i) {
    float sum = 0;
    for (Index j = 0; j < kCoarse * kCoarse; ++j)
      sum +=
          object_[at(p.view)]
                 [at((i / columns * kCoarse + j / kCoarse) * v.width + i % columns * kCoarse + j % kCoarse)];
    std::fill_n(on_object + 3 * i, 3, sum);
  }
  const double ramp = std::clamp((figures_.sign - kReadable) / (kSafe - kReadable), 0.0, 1.0);
  return add(scale(power(coarse, {on_object, at(3 * places)}), ramp * options_.smooth_weight),
             scale(power(residual, flat_[at(p.view)]), ramp * options_.flat_weight));
}

double Embedder::run_dense(const Image& p, Tape<float>& tape, const Params<float>& params,
                           Figures& figures) const {
  const Var<float> added = residual(tape, params, p);
  const CachedView& view = views_[at(p.view)];
  const Var<float> marked = add(tape.constant(view.base.data.data(), {view.height * view.width, 3}), added);
  const Var<float> image = distort(tape, tape.reshape(marked, {view.height, view.width, 3}), p);
  const Index h = image.shape()[0], w = image.shape()[1];
  const auto out = (*owner_.reader)(params, tape.reshape(image, {1, h, w, 3}));

  // Labels move with the pixels, then go to the extractor's places.
  const auto background = static_cast<std::int32_t>(owner_.cells.count());
  Tensor<std::int32_t> labels = labels_[at(p.view)];
  if (p.warped) labels = fieldmark::distort::warp_labels<float>(labels, p.warp, background, h, w);
  labels = fieldmark::distort::resize_labels(labels, out.height, out.width);
  const Index places = out.height * out.width;
  float *target = tape.scratch(places), *on_object = tape.scratch(places);
  for (Index i = 0; i < places; ++i) {
    const std::int8_t sign = labels[i] < background ? p.signs[at(labels[i])] : std::int8_t{0};
    target[i] = sign > 0 ? 1.f : 0.f;
    on_object[i] = sign != 0 ? 1.f : 0.f;
  }
  std::vector<float> bits(p.message.bits.begin(), p.message.bits.end());
  const std::span<const float> on(on_object, at(places));
  const Var<float> pooled = scale(
      extractor::pooled_bits<float>(out.sign, out.index, code_matrix_, owner_.options().bits), kBitScale);
  const Var<float> sign_loss =
      bce_with_logits<float>(out.sign, std::span<const float>(target, at(places)), on);
  const Var<float> index_loss = softmax_cross_entropy<float>(out.index, labels.data);
  const Var<float> bits_loss = bce_with_logits<float>(pooled, bits);
  const Var<float> loss =
      scale(add(add(scale(sign_loss, options_.sign_weight), visibility(added, p)),
                add(scale(index_loss, options_.index_weight), scale(bits_loss, options_.bits_weight))),
            1.0 / static_cast<double>(options_.batch));
  const double value = static_cast<double>(loss.value()[0]);
  tape.backward(loss);

  const Index classes = owner_.cells.count() + 1;
  double sign = 0, index = 0, all = 0, right = 0;
  for (Index i = 0; i < places; ++i) {
    if (on_object[i] == 0) continue;
    const float* q = out.index.value() + i * classes;
    all += 1;
    sign += (out.sign.value()[i] > 0) == (target[i] > 0);
    index += std::none_of(q, q + classes, [most = q[labels[i]]](float other) { return other > most; });
  }
  for (std::size_t b = 0; b < bits.size(); ++b) right += (pooled.value()[b] > 0) == (bits[b] > 0);
  figures = {all > 0 ? sign / all : 0, all > 0 ? index / all : 0, right / static_cast<double>(bits.size()),
             value};
  return value;
}

}  // namespace fieldmark::watermark
