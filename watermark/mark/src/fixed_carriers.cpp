#include "fixed_carriers.h"

#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace fieldmark::watermark {
namespace {

constexpr Index kCellsABit = 3, kCoarsest = 4, kFinest = 24;  // the grid: cells per bit, and places per axis
constexpr double kLeastArea = 2e-3;                           // least share of a cell in the visible area
constexpr std::array<float, 3> kOne{-0.40f, -0.40f, 0.82f}, kZero{0.71f, -0.71f, 0};  // colours of the values
constexpr float kAmplitude = 0.154f;                                                  // an RMS of 21 dB
constexpr float kWaves = 32 * 3.14159265f;  // k: the period is a sixteenth of the cube's side

CellGrid coarse_grid(std::span<const CachedView> views, Index bits) {
  for (Index side = kCoarsest;; side += 2) {
    const CellGrid grid(side, visible_area(views, side),
                        std::min(kLeastArea, 1 / (2.0 * kCellsABit * static_cast<double>(bits))));
    if (side >= kFinest || grid.count() >= kCellsABit * bits) return grid;
  }
}

}  // namespace

FixedCarriers::FixedCarriers(std::span<const CachedView> views, Index bits, std::uint64_t seed)
    : cells_(coarse_grid(views, bits)), bit_(at(cells_.count())) {
  const CounterRng rng(seed, 15);
  std::vector<std::size_t> order(bit_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return rng.bits(a)[0] < rng.bits(b)[0]; });
  for (std::size_t k = 0; k < order.size(); ++k)
    bit_[order[k]] = static_cast<std::int32_t>(k % static_cast<std::size_t>(bits));
}

FixedCarriers::Carried FixedCarriers::carried(const float* x) const {
  const std::int32_t cell = cells_.at(x);
  if (cell < 0) return {-1, 0};
  const float wave =
      (std::sin(kWaves * x[0]) + std::sin(kWaves * x[1]) + std::sin(kWaves * x[2])) / std::sqrt(1.5f);
  return {bit_[at(cell)], wave};
}

void FixedCarriers::mark(std::span<const float> message, const float* x, const float* c, Index n,
                         float* marked) const {
  for (Index i = 0; i < n; ++i) {
    const Carried here = carried(x + 3 * i);
    const auto& axis = here.bit >= 0 && message[at(here.bit)] > 0 ? kOne : kZero;
    for (Index a = 0; a < 3; ++a)
      marked[3 * i + a] = std::clamp(c[3 * i + a] + kAmplitude * here.wave * axis[at(a)], 0.f, 1.f);
  }
}

void FixedCarriers::mark(std::span<const float> message, const CachedView& view, float* marked) const {
  const Index samples = std::ssize(view.weight);
  std::vector<float> colour(at(3 * samples));
  mark(message, view.position.data(), view.colour.data(), samples, colour.data());
  for (Index p = 0; p < view.height * view.width; ++p)
    for (Index a = 0; a < 3; ++a) {
      float sum = view.base[3 * p + a];
      for (Index k = view.sample_begin[at(p)]; k < view.sample_begin[at(p + 1)]; ++k)
        sum += view.weight[at(k)] * (colour[at(3 * k + a)] - view.colour[at(3 * k + a)]);
      marked[3 * p + a] = std::clamp(sum, 0.f, 1.f);
    }
}

}  // namespace fieldmark::watermark
