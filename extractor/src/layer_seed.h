#pragma once
#include <fieldmark/engine/random.h>

namespace fieldmark::extractor {

// Yields one seed per layer of a network. Networks with neighbouring seeds share none, as seed + layer would.
class LayerSeeds {
 public:
  explicit LayerSeeds(std::uint64_t seed) : rng_(seed) {}
  std::uint64_t next() {
    const auto words = rng_.bits(layer_++);
    return std::uint64_t{words[0]} << 32 | words[1];
  }

 private:
  CounterRng rng_;
  std::uint64_t layer_ = 0;
};

}  // namespace fieldmark::extractor
