#include "hiding_trainer.h"
#include <fieldmark/core/number_text.h>
#include <fieldmark/distort/quantize8.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>
#include "image_noise.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace fieldmark::baselines {
namespace {

constexpr double kKeep = 0.95;               // decay of a running mean
constexpr double kRead = 0.93;               // fraction of right bits above which the mark becomes fainter
constexpr double kEachRead = 0.85;           // fraction of images in which each bit must be right for that
constexpr double kFainter = 0.015;           // dB per step
constexpr double kSure = 0.96, kFaster = 2;  // above kSure, extra dB per step per unit of the fraction
constexpr double kLeastRms = 1e-6;
constexpr double kNoiseFrom = 3;        // dB before the final strength: rounding and noise layers begin
constexpr std::uint64_t kWhether = 50;  // counter of its draws; those of a layer are below
constexpr AdamOptions kAdam{.lr = 1, .beta2 = 0.999, .eps = 1e-8, .zero_grads = true};

// Rounds values in [-1, 1] to 8 bits, as a file does.
Var<float> as_file(Var<float> marked) {
  Tape<float>& tape = marked.tape();
  const Index n = marked.shape().size();
  float* halves = tape.scratch(n);
  std::fill_n(halves, n, 0.5f);
  const Var<float> half = tape.constant(halves, marked.shape());
  return scale(sub(distort::quantize8(add(scale(marked, 0.5), half)), half), 2);
}

double mean_of(std::span<const float> read) {
  return std::accumulate(read.begin(), read.end(), 0.0) / static_cast<double>(read.size());
}

}  // namespace

double fading(std::span<const float> read) {
  const double mean = mean_of(read);
  if (!(mean > kRead && static_cast<double>(std::ranges::min(read)) > kEachRead)) return 0;
  return kFainter + kFaster * std::max(0.0, mean - kSure);
}

HidingTrainOptions hiding_train_options(HidingKind kind) {
  HidingTrainOptions o;
  if (kind == HidingKind::mbrs) {
    o.message_weight = 10, o.adversary_weight = 1e-4, o.first_crop = o.crop;
  } else {
    o.crop = 32, o.first_part = 0.8, o.noisy_part = 0.5, o.schedule.lr = 3e-3;
  }
  return o;
}

HidingTrainer::HidingTrainer(ImageMarker& marker, const CropSource& crops, const HidingTrainOptions& options)
    : TrainingRun(options.schedule),
      marker_(marker),
      crops_(crops),
      options_(options),
      message_rng_(options.seed, 81),
      noise_rng_(options.seed, 82),
      critic_(critic_params_, marker.options(), options.seed) {
  if (options.batch < 2 || options.crop < 16 || options.crop % 16 != 0 || options.first_crop < 16 ||
      options.first_crop % 16 != 0)
    throw ValueError("[hiding_trainer] batch must be at least 2 and both crops multiples of 16, got " +
                     std::to_string(options.batch) + ", " + std::to_string(options.crop) + " and " +
                     std::to_string(options.first_crop));
  if (!(options.first_part >= 0 && options.first_part < 1))
    throw ValueError("[hiding_trainer] first_part must be at least 0 and below 1, got " +
                     number_text(options.first_part));
  if (!(options.noisy_part >= 0 && options.noisy_part <= 1))
    throw ValueError("[hiding_trainer] noisy_part must be in [0, 1], got " + number_text(options.noisy_part));
  if (!(options.mark_psnr >= options.first_mark_psnr))
    throw ValueError("[hiding_trainer] mark_psnr must be at least first_mark_psnr, got " +
                     number_text(options.mark_psnr) + " and " + number_text(options.first_mark_psnr));
  figures_.mark_psnr = options.first_mark_psnr;
  train(marker.params, kAdam);
  train(critic_params_, kAdam, {}, "critic/");
  read_.assign(at(marker.options().bits), 0.f);
  keep("bits", figures_.bits);
  keep("bits read", read_);
  keep("mark_psnr", figures_.mark_psnr);
  keep("crop", crop_);
}

// Follows the steps if the run has a number of them, else the clock; never decreases.
Index HidingTrainer::crop_now(double seconds) const {
  const auto& s = options_.schedule;
  const double done =
      s.steps > 0 ? static_cast<double>(steps()) / static_cast<double>(s.steps) : seconds / s.seconds;
  int last = 0, now = 0;  // doublings of the first size
  while (options_.first_crop << last < options_.crop) ++last;
  if (done >= options_.first_part)
    now =
        std::min(last, 1 + static_cast<int>(last * (done - options_.first_part) / (1 - options_.first_part)));
  return std::max(crop_, std::min(options_.first_crop << now, options_.crop));
}

void HidingTrainer::draw(Index size) {
  const Index each = size * size * 3, bits = marker_.options().bits;
  images_.resize(static_cast<std::size_t>(options_.batch * each));
  messages_.clear();
  for (Index i = 0; i < options_.batch; ++i) {
    const auto index = static_cast<std::uint64_t>(steps() * options_.batch + i);
    const Tensor<float> image = crops_.image(size, index);
    for (Index k = 0; k < each; ++k) images_[static_cast<std::size_t>(i * each + k)] = 2 * image[k] - 1;
    const auto message = watermark::random_message(bits, message_rng_, index);
    messages_.insert(messages_.end(), message.bits.begin(), message.bits.end());
  }
}

// True if the images of this step pass rounding and a noise layer: never while the mark is strong.
bool HidingTrainer::noisy() const {
  const double share = (figures_.mark_psnr - options_.mark_psnr + kNoiseFrom) / kNoiseFrom;
  return static_cast<double>(noise_rng_.uniform(static_cast<std::uint64_t>(steps()), kWhether)) <
         std::min(share, options_.noisy_part);
}

Var<float> HidingTrainer::sent_on(Var<float> marked, Var<float> plain) const {
  if (!noisy()) return marked;
  const auto step = static_cast<std::uint64_t>(steps());
  const auto layers = marker_.kind() == HidingKind::mbrs ? mbrs_noise_layers() : hidden_noise_layers();
  const auto which = noise_rng_.below(static_cast<Index>(layers.size()), step);
  return apply_noise_layer(layers[static_cast<std::size_t>(which)], as_file(marked), plain, noise_rng_, step);
}

// plain + g (encoded - plain), where g gives each image's second term the current PSNR.
Var<float> HidingTrainer::at_strength(Var<float> encoded, Var<float> plain) const {
  const Index n = plain.shape()[0], each = plain.shape().size() / n;
  const Var<float> residual = sub(encoded, plain);
  float* gains = plain.tape().scratch(n * each);
  for (Index i = 0; i < n; ++i) {
    double square = 0;
    for (Index k = i * each; k < (i + 1) * each; ++k)
      square += std::pow(0.5 * static_cast<double>(residual.value()[k]), 2);
    const double rms = std::sqrt(square / static_cast<double>(each));
    std::fill_n(gains + i * each, each,
                static_cast<float>(std::pow(10.0, -figures_.mark_psnr / 20) / std::max(rms, kLeastRms)));
  }
  return add(plain, mul(residual, plain.tape().constant(gains, plain.shape())));
}

double HidingTrainer::train_networks(Index size) {
  const Index n = options_.batch, bits = marker_.options().bits;
  tape_.reset();
  const Params<float> params(marker_.params);
  NormPass<float> pass, critic_pass;
  const Var<float> plain = tape_.constant(images_.data(), {n, size, size, 3});
  const Var<float> sent = tape_.constant(messages_.data(), {n, bits});
  const Var<float> marked = at_strength(marker_.network().encode(params, plain, sent, pass), plain);
  const Var<float> read = marker_.network().decode(params, sent_on(marked, plain), pass);
  const Var<float> verdict = critic_(Params<float>(critic_params_, nullptr), marked, critic_pass);
  const std::vector<float> as_plain(static_cast<std::size_t>(n), 0.f);
  const Var<float> loss = add(scale(mse_loss<float>(read, sent), options_.message_weight),
                              scale(bce_with_logits<float>(verdict, as_plain), options_.adversary_weight));
  tape_.backward(loss);
  update();
  update_statistics(marker_.params, pass);
  marked_.assign(marked.value(), marked.value() + marked.shape().size());

  follow(read.value());
  return static_cast<double>(loss.value()[0]);
}

// Moves the running means towards the bits of a step, and makes the mark fainter if they are read.
void HidingTrainer::follow(const float* values) {
  const Index n = options_.batch, bits = marker_.options().bits;
  const double keep = steps() == 0 ? 0 : kKeep;
  for (Index b = 0; b < bits; ++b) {
    Index right = 0;
    for (Index i = b; i < n * bits; i += bits) right += (values[i] > 0.5f) == (messages_[at(i)] > 0.5f);
    read_[at(b)] = static_cast<float>(keep * static_cast<double>(read_[at(b)]) +
                                      (1 - keep) * static_cast<double>(right) / static_cast<double>(n));
  }
  figures_.bits = mean_of(read_);
  figures_.mark_psnr = std::min(figures_.mark_psnr + fading(read_), options_.mark_psnr);
}

void HidingTrainer::train_discriminator(Index size) {
  const Index n = options_.batch;
  tape_.reset();
  std::vector<float> both(images_);
  both.insert(both.end(), marked_.begin(), marked_.end());
  std::vector<float> targets(static_cast<std::size_t>(2 * n), 0.f);
  std::fill_n(targets.begin() + n, n, 1.f);
  NormPass<float> pass;
  const Var<float> verdict =
      critic_(Params<float>(critic_params_), tape_.constant(both.data(), {2 * n, size, size, 3}), pass);
  tape_.backward(bce_with_logits<float>(verdict, targets));
  update(1);
  update_statistics(critic_params_, pass);
}

double HidingTrainer::take_step(double seconds) {
  crop_ = crop_now(seconds);
  draw(crop_);
  const double loss = train_networks(crop_);
  train_discriminator(crop_);
  return loss;
}

std::string HidingTrainer::status() const {
  char text[80];
  std::snprintf(text, sizeof text, "%.1f%% of bits, %.1f%% of the worst, at %.1f dB", 100 * figures_.bits,
                100 * static_cast<double>(std::ranges::min(read_)), figures_.mark_psnr);
  return text;
}

void HidingTrainer::describe(RunFingerprint& f) const {
  const HidingTrainOptions& o = options_;
  f.option("run", hiding_name(marker_.kind()));
  f.option("bits", marker_.options().bits);
  f.option("channels", marker_.options().channels);
  f.option("batch", o.batch);
  f.option("crop", o.crop);
  f.option("first_crop", o.first_crop);
  f.option("first_part", o.first_part);
  f.option("first_mark_psnr", o.first_mark_psnr);
  f.option("mark_psnr", o.mark_psnr);
  f.option("message_weight", o.message_weight);
  f.option("adversary_weight", o.adversary_weight);
  f.option("noisy_part", o.noisy_part);
  f.option("seed", o.seed);
  for (std::size_t i = 0; i < crops_.images().size(); ++i)
    f.input("image " + std::to_string(i), crops_.images()[i].data);
}

}  // namespace fieldmark::baselines
