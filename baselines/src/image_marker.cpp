#include "image_marker.h"
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include "crop_source.h"
#include "mbrs_network.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace fieldmark::baselines {
namespace {

void check_image(const Tensor<float>& cover) {
  check_rank("image_marker", "image", cover.shape, 3, "[height, width, 3]");
  check_extent("image_marker", "image", cover.shape, 2, 3, "red, green, blue");
}

// Positions and size of an image's tiles. If a side is shorter than a tile, the tile has that length; the
// last tile of a side may extend beyond it.
struct Tiles {
  Tiles(const Shape& cover, Index tile) : height(std::min(tile, cover[0])), width(std::min(tile, cover[1])) {
    for (Index y = 0; y < cover[0]; y += height)
      for (Index x = 0; x < cover[1]; x += width) corners.push_back({y, x});
  }
  Index height, width;
  std::vector<std::array<Index, 2>> corners;
};

Tensor<float> tile_of(const Tensor<float>& cover, const Tiles& tiles, const std::array<Index, 2>& corner) {
  return window_of(cover, corner[0], corner[1], {tiles.height, tiles.width, 3});
}

// Converts to the range of the networks: [1, H, W, 3] in [-1, 1].
Tensor<float> centred(const Tensor<float>& tile) {
  Tensor<float> x({1, tile.shape[0], tile.shape[1], 3});
  for (Index i = 0; i < x.size(); ++i) x[i] = 2 * tile[i] - 1;
  return x;
}

constexpr int kGainRounds = 8;
constexpr double kNear = 0.01;  // dB

Tensor<float> added(const Tensor<float>& cover, const Tensor<float>& residual, double gain) {
  Tensor<float> out(cover.shape);
  for (Index i = 0; i < out.size(); ++i) out[i] = cover[i] + static_cast<float>(gain) * residual[i];
  return quantize8(out);
}

// Adds the residual with the gain that gives the file this PSNR; clamping weakens the residual.
Tensor<float> added_at(const Tensor<float>& cover, const Tensor<float>& residual, double mark_psnr) {
  const double square = mse(residual, Tensor<float>(residual.shape));
  if (square <= 0) return quantize8(cover);
  double gain = std::pow(10.0, -mark_psnr / 20) / std::sqrt(square);
  Tensor<float> out = added(cover, residual, gain);
  for (int k = 0; k < kGainRounds; ++k) {
    const double miss = psnr(out, cover) - mark_psnr;
    if (!std::isfinite(miss) || std::abs(miss) < kNear) break;
    gain *= std::pow(10.0, miss / 20);
    out = added(cover, residual, gain);
  }
  return out;
}

}  // namespace

const char* hiding_name(HidingKind kind) { return kind == HidingKind::mbrs ? "mbrs" : "hidden"; }

ImageMarker::ImageMarker(HidingKind kind, const HidingOptions& options, std::uint64_t seed)
    : kind_(kind), options_(options) {
  if (options.tile < 16)
    throw ValueError("[image_marker] tile must be at least 16 pixels, got " + std::to_string(options.tile));
  if (kind == HidingKind::mbrs)
    network_ = std::make_unique<MbrsNetwork<float>>(params, options, seed);
  else
    network_ = std::make_unique<HiddenNetwork<float>>(params, options, seed);
}

Tensor<float> ImageMarker::mark(const Tensor<float>& cover, const watermark::Message& message,
                                double mark_psnr) const {
  if (message.size() != options_.bits)
    throw ValueError("[image_marker] message must have the network's " + std::to_string(options_.bits) +
                     " bits, got " + std::to_string(message.size()));
  check_image(cover);
  const std::vector<float> bits(message.bits.begin(), message.bits.end());
  const Index h = cover.shape[0], w = cover.shape[1];
  const Tiles tiles(cover.shape, options_.tile);
  Tensor<float> residual(cover.shape);
  for (const auto& corner : tiles.corners) {
    const Tensor<float> x = centred(tile_of(cover, tiles, corner));
    Tape<float> tape;
    NormPass<float> pass{.running = true};
    const Var<float> marked = network_->encode(Params<float>(params, nullptr), tape.constant(x),
                                               tape.constant(bits.data(), {1, options_.bits}), pass);
    for (Index y = 0; y < std::min(tiles.height, h - corner[0]); ++y)
      for (Index k = 0; k < 3 * std::min(tiles.width, w - corner[1]); ++k) {
        const Index i = y * tiles.width * 3 + k;
        residual[((corner[0] + y) * w + corner[1]) * 3 + k] = 0.5f * (marked.value()[i] - x[i]);
      }
  }
  return mark_psnr > 0 ? added_at(cover, residual, mark_psnr) : added(cover, residual, 1);
}

watermark::Message ImageMarker::read(const Tensor<float>& cover) const {
  check_image(cover);
  const Tiles tiles(cover.shape, options_.tile);
  std::vector<Tensor<float>> whole, shown;
  for (const auto& corner : tiles.corners) {
    if (corner[0] + tiles.height > cover.shape[0] || corner[1] + tiles.width > cover.shape[1]) continue;
    whole.push_back(tile_of(cover, tiles, corner));
    if (shows_something(whole.back())) shown.push_back(whole.back());
  }
  const auto& asked = shown.empty() ? whole : shown;
  std::vector<double> sum(static_cast<std::size_t>(options_.bits));
  for (const Tensor<float>& tile : asked) {
    Tape<float> tape;
    NormPass<float> pass{.running = true};
    const Tensor<float> x = centred(tile);
    const Var<float> said = network_->decode(Params<float>(params, nullptr), tape.constant(x), pass);
    for (std::size_t b = 0; b < sum.size(); ++b) sum[b] += static_cast<double>(said.value()[b]);
  }
  watermark::Message message;
  for (const double s : sum) message.bits.push_back(s > 0.5 * static_cast<double>(asked.size()) ? 1 : 0);
  return message;
}

double ImageMarker::accuracy(const Tensor<float>& cover, const watermark::Message& sent) const {
  const watermark::Message found = read(cover);
  double right = 0;
  for (std::size_t b = 0; b < found.bits.size(); ++b) right += found.bits[b] == sent.bits.at(b);
  return right / static_cast<double>(found.size());
}

}  // namespace fieldmark::baselines
