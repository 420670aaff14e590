#include <fieldmark/baselines/mbrs_network.h>
#include <fieldmark/baselines/picture_marker.h>
#include <fieldmark/engine/image.h>
#include <fieldmark/engine/metrics.h>

#include <cmath>
#include <string>

namespace fieldmark::baselines {
namespace {

Tensor<float> centred(const Tensor<float>& picture) {
  check_rank("picture_marker", "picture", picture.shape, 3, "[height, width, 3]");
  check_extent("picture_marker", "picture", picture.shape, 2, 3, "red, green, blue");
  Tensor<float> x({1, picture.shape[0], picture.shape[1], 3});
  for (Index i = 0; i < x.size(); ++i) x[i] = 2 * picture[i] - 1;
  return x;
}

constexpr int kGainRounds = 8;
constexpr double kNear = 0.01;  // dB

Tensor<float> added(const Tensor<float>& picture, const Tensor<float>& residual, double gain) {
  Tensor<float> out(picture.shape);
  for (Index i = 0; i < out.size(); ++i) out[i] = picture[i] + static_cast<float>(gain) * residual[i];
  return quantize8(out);
}

// With the gain at which the file has the strength: black and white take a part of the residual away.
Tensor<float> added_at(const Tensor<float>& picture, const Tensor<float>& residual, double strength) {
  const double level = psnr(residual, Tensor<float>(residual.shape));
  if (!std::isfinite(level)) return added(picture, residual, 1);
  double gain = std::pow(10.0, (level - strength) / 20);
  Tensor<float> out = added(picture, residual, gain);
  for (int k = 0; k < kGainRounds; ++k) {
    const double miss = psnr(out, picture) - strength;
    if (!std::isfinite(miss) || std::abs(miss) < kNear) break;
    gain *= std::pow(10.0, miss / 20);
    out = added(picture, residual, gain);
  }
  return out;
}

}  // namespace

const char* hiding_name(HidingKind kind) { return kind == HidingKind::mbrs ? "mbrs" : "hidden"; }

PictureMarker::PictureMarker(HidingKind kind, const HidingOptions& options, std::uint64_t seed)
    : kind_(kind), options_(options) {
  if (kind == HidingKind::mbrs)
    network_ = std::make_unique<MbrsNetwork<float>>(params, options, seed);
  else
    network_ = std::make_unique<HiddenNetwork<float>>(params, options, seed);
}

Tensor<float> PictureMarker::mark(const Tensor<float>& picture, const watermark::Message& message,
                                  double strength) const {
  if (message.size() != options_.bits)
    throw ValueError("[picture_marker] message must have the network's " + std::to_string(options_.bits) +
                     " bits, got " + std::to_string(message.size()));
  const Tensor<float> x = centred(picture);
  const std::vector<float> bits(message.bits.begin(), message.bits.end());
  Tape<float> tape;
  NormPass<float> pass{.running = true};
  const Var<float> marked = network_->encode(Params<float>(params, nullptr), tape.constant(x),
                                             tape.constant(bits.data(), {1, options_.bits}), pass);
  Tensor<float> residual(picture.shape);
  for (Index i = 0; i < x.size(); ++i) residual[i] = 0.5f * (marked.value()[i] - x[i]);
  return strength > 0 ? added_at(picture, residual, strength) : added(picture, residual, 1);
}

watermark::Message PictureMarker::read(const Tensor<float>& picture) const {
  const Tensor<float> x = centred(picture);
  Tape<float> tape;
  NormPass<float> pass{.running = true};
  const Var<float> said = network_->decode(Params<float>(params, nullptr), tape.constant(x), pass);
  watermark::Message message;
  for (Index b = 0; b < options_.bits; ++b) message.bits.push_back(said.value()[b] > 0.5f ? 1 : 0);
  return message;
}

double PictureMarker::accuracy(const Tensor<float>& picture, const watermark::Message& sent) const {
  const watermark::Message found = read(picture);
  double right = 0;
  for (std::size_t b = 0; b < found.bits.size(); ++b) right += found.bits[b] == sent.bits.at(b);
  return right / static_cast<double>(found.size());
}

}  // namespace fieldmark::baselines
