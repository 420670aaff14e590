#include <fieldmark/baselines/hiding_trainer.h>
#include <fieldmark/baselines/picture_noise.h>
#include <fieldmark/engine/checkpoint.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/loss.h>

#include <algorithm>
#include <string>

namespace fieldmark::baselines {
namespace {

constexpr double kKeep = 0.95;  // of a running mean
constexpr double kLeastImageWeight = 0.02, kUnread = 0.8, kRead = 0.95;
constexpr AdamOptions kAdam{.lr = 1, .beta2 = 0.999, .eps = 1e-8, .zero_grads = true};

double part(double value, double from, double to) {
  return std::clamp((value - from) / (to - from), 0.0, 1.0);
}

}  // namespace

HidingTrainOptions hiding_train_options(HidingKind kind) {
  HidingTrainOptions o;
  if (kind == HidingKind::mbrs)
    o.message_weight = 10, o.image_weight = 1, o.adversary_weight = 1e-4, o.first_crop = o.crop;
  return o;
}

HidingTrainer::HidingTrainer(PictureMarker& marker, const CropSource& crops,
                             const HidingTrainOptions& options)
    : marker_(marker),
      crops_(crops),
      options_(options),
      schedule_(options.schedule),
      message_rng_(options.seed, 81),
      noise_rng_(options.seed, 82),
      critic_(critic_params_, marker.options(), options.seed),
      adam_(marker.params.size(), kAdam),
      critic_adam_(critic_params_.size(), kAdam) {
  if (options.batch < 2 || options.crop < 16 || options.crop % 16 != 0 || options.first_crop < 16 ||
      options.first_crop % 16 != 0)
    throw ValueError("[hiding_trainer] batch must be at least 2 and both crops multiples of 16, got " +
                     std::to_string(options.batch) + ", " + std::to_string(options.crop) + " and " +
                     std::to_string(options.first_crop));
  if (!(options.first_part >= 0 && options.first_part < 1))
    throw ValueError("[hiding_trainer] first_part must be at least 0 and below 1, got " +
                     std::to_string(options.first_part));
}

// By steps where the run has a number of them, else by the clock; never back.
Index HidingTrainer::crop_now(double seconds) const {
  const auto& s = options_.schedule;
  const double done =
      s.steps > 0 ? static_cast<double>(steps_) / static_cast<double>(s.steps) : seconds / s.seconds;
  return large_ || done >= options_.first_part ? options_.crop : options_.first_crop;
}

void HidingTrainer::draw(Index size) {
  const Index each = size * size * 3, bits = marker_.options().bits;
  pictures_.resize(static_cast<std::size_t>(options_.batch * each));
  messages_.clear();
  for (Index i = 0; i < options_.batch; ++i) {
    const auto index = static_cast<std::uint64_t>(steps_ * options_.batch + i);
    const Tensor<float> picture = crops_.picture(size, index);
    for (Index k = 0; k < each; ++k) pictures_[static_cast<std::size_t>(i * each + k)] = 2 * picture[k] - 1;
    const auto message = watermark::random_message(bits, message_rng_, index);
    messages_.insert(messages_.end(), message.bits.begin(), message.bits.end());
  }
}

void HidingTrainer::train_networks(Index size) {
  const Index n = options_.batch, bits = marker_.options().bits;
  tape_.reset();
  const Params<float> params(marker_.params);
  NormPass<float> pass, critic_pass;
  const Var<float> plain = tape_.constant(pictures_.data(), {n, size, size, 3});
  const Var<float> sent = tape_.constant(messages_.data(), {n, bits});
  const Var<float> marked = marker_.network().encode(params, plain, sent, pass);
  const auto layers = marker_.kind() == HidingKind::mbrs ? mbrs_noise_layers() : hidden_noise_layers();
  const auto layer = layers[static_cast<std::size_t>(
      noise_rng_.below(static_cast<Index>(layers.size()), static_cast<std::uint64_t>(steps_)))];
  const Var<float> noised =
      apply_noise_layer(layer, marked, plain, noise_rng_, static_cast<std::uint64_t>(steps_));
  const Var<float> read = marker_.network().decode(params, noised, pass);
  const Var<float> verdict = critic_(Params<float>(critic_params_, nullptr), marked, critic_pass);
  const std::vector<float> as_plain(static_cast<std::size_t>(n), 0.f);
  const Var<float> message_loss = mse_loss<float>(read, sent), image_loss = mse_loss<float>(marked, plain);
  const double visible =
      options_.image_weight * std::max(kLeastImageWeight, part(figures_.bits, kUnread, kRead));
  const Var<float> loss = add(add(scale(message_loss, options_.message_weight), scale(image_loss, visible)),
                              scale(bce_with_logits<float>(verdict, as_plain), options_.adversary_weight));
  tape_.backward(loss);
  adam_.step(marker_.params.values(), marker_.params.grads(), schedule_.lr(steps_));
  update_statistics(marker_.params, pass);
  marked_.assign(marked.value(), marked.value() + marked.shape().size());

  double right = 0;
  for (Index i = 0; i < n * bits; ++i)
    right += (read.value()[i] > 0.5f) == (messages_[static_cast<std::size_t>(i)] > 0.5f);
  const double keep = steps_ == 0 ? 0 : kKeep;
  figures_.bits = keep * figures_.bits + (1 - keep) * right / static_cast<double>(n * bits);
  figures_.square = keep * figures_.square + (1 - keep) * static_cast<double>(image_loss.value()[0]) / 4;
}

void HidingTrainer::train_discriminator(Index size) {
  const Index n = options_.batch;
  tape_.reset();
  std::vector<float> both(pictures_);
  both.insert(both.end(), marked_.begin(), marked_.end());
  std::vector<float> targets(static_cast<std::size_t>(2 * n), 0.f);
  std::fill_n(targets.begin() + n, n, 1.f);
  NormPass<float> pass;
  const Var<float> verdict =
      critic_(Params<float>(critic_params_), tape_.constant(both.data(), {2 * n, size, size, 3}), pass);
  tape_.backward(bce_with_logits<float>(verdict, targets));
  critic_adam_.step(critic_params_.values(), critic_params_.grads(), schedule_.lr(steps_));
  update_statistics(critic_params_, pass);
}

void HidingTrainer::step(double seconds) {
  schedule_.observe(steps_, seconds);
  const Index size = crop_now(seconds);
  large_ = size == options_.crop;
  draw(size);
  train_networks(size);
  train_discriminator(size);
  ++steps_;
}

std::string HidingTrainer::fingerprint() const {
  const auto& o = options_;
  return std::string(hiding_name(marker_.kind())) + ", " + std::to_string(marker_.options().bits) +
         " bits, " + std::to_string(marker_.options().channels) + " channels, batch " +
         std::to_string(o.batch) + ", crops " + std::to_string(o.first_crop) + " and " +
         std::to_string(o.crop) + " after " + std::to_string(o.first_part) + ", weights " +
         std::to_string(o.message_weight) + " " + std::to_string(o.image_weight) + " " +
         std::to_string(o.adversary_weight) + ", lr " + std::to_string(o.schedule.lr) + ", half after " +
         std::to_string(o.schedule.half_after) + ", cooldown " + std::to_string(o.schedule.cooldown) +
         " to " + std::to_string(o.schedule.last) + ", seed " + std::to_string(o.seed);
}

void HidingTrainer::save(const std::filesystem::path& path) const {
  SafetensorsFile file = new_checkpoint(fingerprint());
  const Index n = marker_.params.size(), c = critic_params_.size();
  const ParamStore<float>& net = marker_.params;
  file.add("values", {n}, net.values());
  file.add("mean", {n}, adam_.mean());
  file.add("mean_square", {n}, adam_.mean_square());
  file.add("critic/values", {c}, critic_params_.values());
  file.add("critic/mean", {c}, critic_adam_.mean());
  file.add("critic/mean_square", {c}, critic_adam_.mean_square());
  const std::int64_t counts[] = {steps_, schedule_.total(), large_ ? 1 : 0};
  const double figures[] = {figures_.bits, figures_.square};
  file.add("counts", {3}, counts);
  file.add("figures", {2}, figures);
  file.write(path);
}

void HidingTrainer::restore(const std::filesystem::path& path) {
  const SafetensorsFile file = read_checkpoint(path, fingerprint());
  restore_numbers(file, "values", marker_.params.values());
  restore_numbers(file, "mean", adam_.mean());
  restore_numbers(file, "mean_square", adam_.mean_square());
  restore_numbers(file, "critic/values", critic_params_.values());
  restore_numbers(file, "critic/mean", critic_adam_.mean());
  restore_numbers(file, "critic/mean_square", critic_adam_.mean_square());
  const auto counts = file.i64("counts");
  const auto figures = file.f64("figures").data;
  if (counts.size() != 3 || figures.size() != 2)
    throw IoError(path.string() + ": expected 3 counts and 2 figures, found " +
                  std::to_string(counts.size()) + " and " + std::to_string(figures.size()));
  steps_ = counts[0];
  schedule_.resume(counts[1]);
  large_ = counts[2] != 0;
  adam_.set_steps(steps_);
  critic_adam_.set_steps(steps_);
  figures_ = {figures[0], figures[1]};
}

}  // namespace fieldmark::baselines
