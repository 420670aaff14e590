#include "pooled_training.h"

#include <fieldmark/core/number_text.h>
#include <fieldmark/distort/affine_warp.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/watermark/mark/owner.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "optional_term.h"

namespace fieldmark::watermark {
namespace {

// The warm start: the bits' values are learnt first, then the weights of the places rise.
constexpr double kValues = 350, kRise = 200;     // steps
constexpr double kElsewhere = 0.3, kSilent = 2;  // first and last weight of bits that a pixel lacks
constexpr float kOfBackground = 0.3f;            // weight of the background's logits relative to the object's
constexpr double kIndex = 0.5;                   // final weight of the carried bit's cross-entropy
constexpr double kPixelsABit = 2;                // a pixel's logit over its part of the pooled one, per bit
constexpr Index kBitsOfWarmStart = 16;           // up to which warm_steps suffice
constexpr double kMomentum = 0.05;               // of the running statistics

// Stacks tensors along the first axis of `shape`.
Var<float> stacked(std::span<const Var<float>> parts, const Shape& shape) {
  Tape<float>& tape = parts.front().tape();
  std::vector<Var<float>> rows;
  for (const Var<float>& part : parts) rows.push_back(tape.reshape(part, {1, part.shape().size()}));
  return tape.reshape(concatenate<float>(rows), shape);
}

Var<float> sum_of(std::span<const Var<float>> terms) {
  Var<float> sum = terms.front();
  for (const Var<float>& term : terms.subspan(1)) sum = add(sum, term);
  return sum;
}

float* message_of(Tape<float>& tape, const TrainingImage& image) {
  float* sent = tape.scratch(std::ssize(image.signs));
  std::copy(image.signs.begin(), image.signs.end(), sent);
  return sent;
}

}  // namespace

PooledTraining::PooledTraining(const extractor::PooledExtractor<float>& reader,
                               const PooledTrainingOptions& options, bool running_norm, const Owner& owner,
                               std::span<const CachedView> views, PooledMark::Painter painter,
                               PooledMark::Learner learner)
    : reader_(reader),
      options_(options),
      running_norm_(running_norm),
      owner_(owner),
      views_(views),
      painter_(std::move(painter)),
      learner_(std::move(learner)) {
  keep_features();
  if (options.warm_steps == 0) return;
  const Index bits = owner.options().bits;
  carriers_.emplace(views, bits, owner.options().seed);
  recognise_.emplace_back(helpers_, "recognise", DenseOptions{.in = reader.channels(), .out = bits + 2},
                          owner.options().seed + 300);
}

Var<float> PooledTraining::loss(Tape<float>& tape, const Params<float>& params,
                                std::span<const TrainingImage> images, const TrainingFigures&,
                                TrainingFigures& figures) {
  if (images.front().step < warm_steps()) return lesson(tape, params, images, figures);
  const Index bits = owner_.options().bits;
  std::vector<Var<float>> seen, marked;
  for (const TrainingImage& image : images) {
    const CachedView& v = views_[at(image.view)];
    const Var<float> painted =
        painter_(tape, params, image, tape.constant(message_of(tape, image), {1, bits}));
    marked.push_back(tape.reshape(painted, {v.height, v.width, 3}));
    seen.push_back(image.distort(marked.back()));
  }
  return add(content_loss(images, marked),
             scale(message_loss(read(params, seen), images, figures), options_.message_weight));
}

// The mean over the images of a step.
Var<float> PooledTraining::content_loss(std::span<const TrainingImage> images,
                                        std::span<const Var<float>> marked) const {
  std::vector<Var<float>> squares, perceived;
  for (std::size_t i = 0; i < marked.size(); ++i) {
    const std::size_t view = at(images[i].view);
    const Var<float> base = marked[i].tape().constant(views_[view].base.data.data(), marked[i].shape());
    squares.push_back(mse_loss<float>(marked[i], base));
    if (!features_.empty()) perceived.push_back(perceptual_loss(marked[i], features_[view]));
  }
  const auto n = static_cast<double>(marked.size());
  const Var<float> square = sum_of(squares);
  const double weight = content_weight(static_cast<double>(square.value()[0]) / n) / n;
  const Var<float> plain = scale(square, weight);
  return perceived.empty() ? plain
                           : add(plain, scale(sum_of(perceived), weight * options_.perceptual.weight));
}

// The deepest features of an image [H, W, 3].
Var<float> PooledTraining::features_of(Var<float> image) const {
  const Vgg16Features<float>& features = *options_.perceptual.features;
  const std::string depth = features.depths().back();
  const std::string_view tap[] = {depth};
  const Shape& size = image.shape();
  return features(image.tape().reshape(image, {1, size[0], size[1], 3}), tap).front();
}

// The unmarked images do not change, so their features are computed once.
void PooledTraining::keep_features() {
  const PerceptualTerm& term = options_.perceptual;
  if (!(term.weight >= 0))
    throw ValueError("[PooledTraining] perceptual: weight must be at least 0, got " +
                     number_text(term.weight));
  if (term.weight == 0) return;
  if (!term.features || term.sha256.empty())
    throw ValueError("[PooledTraining] perceptual: a weight above 0 needs features and their SHA-256");
  Tape<float> tape;
  for (const CachedView& v : views_) {
    tape.reset();
    const Var<float> found = features_of(tape.constant(v.base.data.data(), {v.height, v.width, 3}));
    Tensor<float> kept(found.shape());
    std::copy_n(found.value(), kept.size(), kept.data.begin());
    features_.push_back(std::move(kept));
  }
}

// |Psi(marked) - Psi(base)|^2 / n for n values of an image, as the mean square of marked - base is
// |marked - base|^2 / n.
Var<float> PooledTraining::perceptual_loss(Var<float> marked, const Tensor<float>& features) const {
  const Var<float> of_base = marked.tape().constant(features.data.data(), features.shape);
  return scale(mse_loss<float>(features_of(marked), of_base),
               static_cast<double>(features.size()) / static_cast<double>(marked.shape().size()));
}

// Each bit has its own carriers to learn.
Index PooledTraining::warm_steps() const {
  return options_.warm_steps * std::max(owner_.options().bits, kBitsOfWarmStart) / kBitsOfWarmStart;
}

// A long message is learnt slowly: at a constant weight, its mark would fade before it can be read.
double PooledTraining::content_weight(double mean_square) const {
  if (options_.content_psnr == 0) return options_.content_weight;
  const double relative = mean_square * std::pow(10.0, options_.content_psnr / 10);
  return options_.content_weight * std::min(1.0, relative * relative);
}

// Reads images [H, W, 3] of one size, normalised together or one by one: the logits [images, N_b].
Var<float> PooledTraining::read(const Params<float>& params, std::span<const Var<float>> seen) {
  const Shape& size = seen.front().shape();
  if (running_norm_)
    return reader_(params, stacked(seen, {std::ssize(seen), size[0], size[1], 3}), &statistics_);
  std::vector<Var<float>> images;
  for (const Var<float>& image : seen)
    images.push_back(reader_(params, image.tape().reshape(image, {1, size[0], size[1], 3})));
  return stacked(images, {std::ssize(seen), owner_.options().bits});
}

// As read(), with the values before the average.
PooledTraining::Places PooledTraining::read_places(const Params<float>& params,
                                                   std::span<const Var<float>> seen) {
  const Shape& size = seen.front().shape();
  if (running_norm_)
    return reader_.places(params, stacked(seen, {std::ssize(seen), size[0], size[1], 3}), &statistics_);
  const Index n = std::ssize(seen), bits = owner_.options().bits;
  std::vector<Var<float>> features, pixels, images;
  for (const Var<float>& image : seen) {
    const Places one = reader_.places(params, image.tape().reshape(image, {1, size[0], size[1], 3}));
    features.push_back(one.features);
    pixels.push_back(one.pixels);
    images.push_back(one.images);
  }
  return {.features = stacked(features, {n * size[0] * size[1], reader_.channels()}),
          .pixels = stacked(pixels, {n * size[0] * size[1], bits}),
          .images = stacked(images, {n, bits})};
}

Var<float> PooledTraining::message_loss(Var<float> logits, std::span<const TrainingImage> images,
                                        TrainingFigures& figures) {
  const Index n = logits.shape().size();
  float* sent = logits.tape().scratch(n);
  double right = 0;
  Index k = 0;
  for (const TrainingImage& image : images)
    for (const std::int8_t sign : image.signs) {
      right += (logits.value()[k] > 0) == (sign > 0);
      sent[k++] = sign > 0 ? 1.f : 0.f;
    }
  figures = {.bits = right / static_cast<double>(n)};
  return bce_with_logits<float>(logits, std::span<const float>(sent, at(n)));
}

// The extractor learns to read the carriers, and the mark's networks learn to paint them.
Var<float> PooledTraining::lesson(Tape<float>& tape, const Params<float>& params,
                                  std::span<const TrainingImage> images, TrainingFigures& figures) {
  const Var<float> reading = reading_lesson(tape, params, images, figures);
  if (!learner_) return reading;
  return add(reading, learner_(tape, params, *carriers_, images.front().step));
}

// Returns the bit that each pixel of a distorted image carries; N_b: none on the object, N_b + 1: background.
Tensor<std::int32_t> PooledTraining::carried_bits(const TrainingImage& image, const Shape& seen) const {
  const CachedView& v = views_[at(image.view)];
  const auto none = static_cast<std::int32_t>(owner_.options().bits);
  Tensor<std::int32_t> labels({v.height, v.width}, none + 1);
  for (Index p = 0; p < labels.size(); ++p) {
    const Index first = v.sample_begin[at(p)];
    if (v.opacity[p] <= 0.5f || first == v.sample_begin[at(p + 1)]) continue;
    const std::int32_t bit = carriers_->carried(&v.position[at(3 * first)]).bit;
    labels[p] = bit < 0 ? none : bit;
  }
  return image.warped ? distort::warp_labels(labels, image.warp, none + 1, seen[0], seen[1]) : labels;
}

// Each pixel shows its own bit and no other; the mean over pixels shows the message. An extra layer,
// discarded after training, must tell that bit from the features.
Var<float> PooledTraining::reading_lesson(Tape<float>& tape, const Params<float>& params,
                                          std::span<const TrainingImage> images, TrainingFigures& figures) {
  const Index bits = owner_.options().bits;
  std::vector<Var<float>> seen;
  for (const TrainingImage& image : images) {
    const CachedView& v = views_[at(image.view)];
    float* marked = tape.scratch(v.base.size());
    carriers_->mark({message_of(tape, image), at(bits)}, v, marked);
    seen.push_back(image.distort(tape.constant(marked, v.base.shape)));
  }
  const Places logits = read_places(params, seen);
  const Index n = logits.pixels.shape().size(), each = n / std::ssize(images);
  auto* label = tape.scratch<std::int32_t>(n / bits);
  float *target = tape.scratch(n), *own = tape.scratch(n), *other = tape.scratch(n), *zeros = tape.scratch(n);
  std::fill_n(zeros, n, 0.f);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const Tensor<std::int32_t> labels = carried_bits(images[i], seen[i].shape());
    std::copy(labels.data.begin(), labels.data.end(), label + static_cast<Index>(i) * labels.size());
    for (Index p = 0; p < labels.size(); ++p)
      for (Index b = 0; b < bits; ++b) {
        const Index k = static_cast<Index>(i) * each + p * bits + b;
        target[k] = images[i].signs[at(b)] > 0 ? 1.f : 0.f;
        own[k] = labels[p] == b ? 1.f : 0.f;
        other[k] = labels[p] == b ? 0.f : labels[p] > bits ? kOfBackground : 1.f;
      }
  }
  const auto all = [n](const float* from) { return std::span(from, at(n)); };
  const Var<float> pixels = scale(logits.pixels, 1 / (kPixelsABit * static_cast<double>(bits)));
  const Var<float> shown =
      term_or_zero(pixels, all(own), [&] { return bce_with_logits<float>(pixels, all(target), all(own)); });
  const Var<float> silent = term_or_zero(pixels, all(other), [&] {
    return mse_loss<float>(pixels, tape.constant(zeros, pixels.shape()), all(other));
  });
  const double ramp = std::clamp((static_cast<double>(images.front().step) - kValues) / kRise, 0.0, 1.0);
  const Var<float> index =
      softmax_cross_entropy<float>(recognise_[0](Params<float>(helpers_), logits.features),
                                   std::span<const std::int32_t>(label, at(n / bits)));
  return add(add(shown, scale(silent, kElsewhere + (kSilent - kElsewhere) * ramp)),
             add(scale(index, kIndex * ramp), message_loss(logits.images, images, figures)));
}

void PooledTraining::finish_step(ParamStore<float>& params) {
  if (running_norm_) reader_.update(params, statistics_, kMomentum);
}

std::string PooledTraining::note(const TrainingFigures& f) const {
  char note[64];
  std::snprintf(note, sizeof note, "right: bits %.1f%%  loss %.4f", 100 * f.bits, f.loss);
  return note;
}

void PooledTraining::describe(RunFingerprint& f) const {
  f.option("content_weight", options_.content_weight);
  f.option("content_psnr", options_.content_psnr);
  f.option("message_weight", options_.message_weight);
  f.option("matrix_rate", options_.matrix_rate);
  if (options_.perceptual.weight > 0) {
    f.option("perceptual_weight", options_.perceptual.weight);
    f.input_digest("perceptual_weights", options_.perceptual.sha256);
  }
  f.option("warm_steps", warm_steps());
  if (owner_.mark().has_gain()) f.option("mark_psnr", owner_.options().mark_psnr);
}

}  // namespace fieldmark::watermark
