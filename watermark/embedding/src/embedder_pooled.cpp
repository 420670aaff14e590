#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/watermark/mark/power_budget.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include "training_image.h"

// Preset paper: one message for the whole field, read from the whole image.
namespace fieldmark::watermark {
namespace {
std::size_t at(Index i) { return static_cast<std::size_t>(i); }
}  // namespace

// The watermarked image [pixels, 3]: colours of the message composited over the background or, under a
// budget, the base image and what they change in it.
Var<float> Embedder::fused_image(Tape<float>& tape, const Params<float>& params, const Image& p,
                                 Var<float> message) const {
  const CachedView& v = views_[at(p.view)];
  const Index samples = static_cast<Index>(v.weight.size()), pixels = v.height * v.width;
  const std::vector<float>& base = colours_[at(p.view)];
  const Var<float> colour = (*owner_.global_mark)(
      params, tape.constant(shifted_positions(tape, p), {samples, 3}),
      tape.constant(v.direction.data(), {samples, 3}),
      tape.constant(base.data(), {samples, owner_.global_mark->colour_inputs()}), message);
  if (owner_.options().budget)
    return add(tape.constant(v.base.data.data(), {pixels, 3}),
               power_budget<float>(
                   weighted_segments<float>(sub(colour, tape.constant(v.colour.data(), {samples, 3})),
                                            v.sample_begin, v.weight),
                   object_[at(p.view)], p.target));
  const float level = nerf::background_value(owner_.field.background);
  float* behind = tape.scratch(3 * pixels);
  for (Index i = 0; i < pixels; ++i) {
    float opacity = 0;
    for (Index k = v.sample_begin[at(i)]; k < v.sample_begin[at(i + 1)]; ++k) opacity += v.weight[at(k)];
    std::fill_n(behind + 3 * i, 3, (1 - opacity) * level);
  }
  return add(weighted_segments<float>(colour, v.sample_begin, v.weight), tape.constant(behind, {pixels, 3}));
}

double Embedder::run_pooled(const Image& p, Tape<float>& tape, const Params<float>& params,
                            Figures& figures) const {
  const CachedView& v = views_[at(p.view)];
  const auto bits = static_cast<Index>(p.signs.size());
  float* sent = tape.scratch(bits);
  std::copy(p.signs.begin(), p.signs.end(), sent);
  const Var<float> message = tape.constant(sent, {1, bits});
  const Var<float> marked =
      options_.image ? options_.image(tape, params, v, message) : fused_image(tape, params, p, message);
  const Var<float> content = mse_loss<float>(marked, tape.constant(v.base.data.data(), marked.shape()));

  const Var<float> image = distort(tape, tape.reshape(marked, {v.height, v.width, 3}), p);
  const Var<float> logits = tape.reshape(
      (*owner_.pooled_reader)(params, tape.reshape(image, {1, image.shape()[0], image.shape()[1], 3})),
      {bits});
  std::vector<float> targets(at(bits));
  for (Index b = 0; b < bits; ++b) targets[at(b)] = sent[b] > 0 ? 1.f : 0.f;
  const double content_weight = owner_.options().budget ? 0 : options_.content_weight;
  const Var<float> loss = scale(add(scale(content, content_weight),
                                    scale(bce_with_logits<float>(logits, targets), options_.message_weight)),
                                1.0 / static_cast<double>(options_.batch));
  const double value = static_cast<double>(loss.value()[0]);
  tape.backward(loss);
  double right = 0;
  for (Index b = 0; b < bits; ++b) right += (logits.value()[b] > 0) == (sent[b] > 0);
  figures = {.bits = right / static_cast<double>(bits), .loss = value};
  return value;
}

}  // namespace fieldmark::watermark
