#include <Random123/philox.h>
#include <fieldmark/core/error.h>
#include <fieldmark/engine/random.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

namespace fieldmark {
namespace {

__extension__ typedef unsigned __int128 Wide;

std::uint32_t low(std::uint64_t x) { return static_cast<std::uint32_t>(x); }
std::uint32_t high(std::uint64_t x) { return static_cast<std::uint32_t>(x >> 32); }

std::array<std::uint32_t, 4> philox(std::uint64_t a, std::uint64_t b, std::array<std::uint32_t, 2> key) {
  const r123::Philox4x32::ctr_type counter = {{low(a), high(a), low(b), high(b)}};
  const r123::Philox4x32::key_type k = {{key[0], key[1]}};
  const auto r = r123::Philox4x32()(counter, k);
  return {r[0], r[1], r[2], r[3]};
}

std::uint64_t join(std::uint32_t lo, std::uint32_t hi) { return lo | static_cast<std::uint64_t>(hi) << 32; }

float unit(std::uint32_t word) { return static_cast<float>(word >> 8) * 0x1p-24f; }

std::pair<float, float> box_muller(std::uint32_t radius, std::uint32_t angle) {
  // (word + 1) / 2^32 lies in (0, 1]: the logarithm is finite.
  const double r = std::sqrt(-2 * std::log((static_cast<double>(radius) + 1) * 0x1p-32));
  const double phi = 2 * std::numbers::pi * static_cast<double>(angle) * 0x1p-32;
  return {static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi))};
}

}  // namespace

CounterRng::CounterRng(std::uint64_t seed, std::uint64_t stream) : key_{low(seed), high(seed)} {
  if (stream == 0) return;
  // The second half of the counter keeps this block apart from the small (a, b) that callers request of
  // stream 0.
  const auto block = philox(stream, ~std::uint64_t{0}, key_);
  key_ = {block[0], block[1]};
}

std::array<std::uint32_t, 4> CounterRng::bits(std::uint64_t a, std::uint64_t b) const {
  return philox(a, b, key_);
}

float CounterRng::uniform(std::uint64_t a, std::uint64_t b) const { return unit(bits(a, b)[0]); }

std::array<float, 4> CounterRng::uniform4(std::uint64_t a, std::uint64_t b) const {
  const auto w = bits(a, b);
  return {unit(w[0]), unit(w[1]), unit(w[2]), unit(w[3])};
}

double CounterRng::uniform_double(std::uint64_t a, std::uint64_t b) const {
  const auto w = bits(a, b);
  return static_cast<double>(join(w[0], w[1]) >> 11) * 0x1p-53;
}

std::array<float, 2> CounterRng::normal2(std::uint64_t a, std::uint64_t b) const {
  const auto w = bits(a, b);
  const auto [x, y] = box_muller(w[0], w[1]);
  return {x, y};
}

std::array<float, 4> CounterRng::normal4(std::uint64_t a, std::uint64_t b) const {
  const auto w = bits(a, b);
  const auto [x, y] = box_muller(w[0], w[1]);
  const auto [z, t] = box_muller(w[2], w[3]);
  return {x, y, z, t};
}

Index CounterRng::below(Index n, std::uint64_t a, std::uint64_t b) const {
  if (n < 1) throw ValueError("[CounterRng::below] n must be at least 1, got " + std::to_string(n));
  const auto w = bits(a, b);
  // High word of the 128-bit product, as in Lemire 2019 (Fast random integer generation in an interval), but
  // without rejection.
  return static_cast<Index>(static_cast<Wide>(join(w[0], w[1])) * static_cast<Wide>(n) >> 64);
}

std::vector<Index> permutation(Index n, const CounterRng& rng, std::uint64_t a) {
  if (n < 0) throw ValueError("[permutation] n must not be negative, got " + std::to_string(n));
  std::vector<Index> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), Index{0});
  for (Index i = n - 1; i > 0; --i) {
    const Index j = rng.below(i + 1, a, static_cast<std::uint64_t>(i));
    std::swap(order[static_cast<std::size_t>(i)], order[static_cast<std::size_t>(j)]);
  }
  return order;
}

}  // namespace fieldmark
