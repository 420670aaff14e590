#include "balanced_classes.h"

#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <numeric>

namespace fieldmark::watermark {
namespace {

constexpr std::int64_t kUnit = 1 << 20;  // of a gain: sums over thousands of views fit 63 bits
constexpr Index kClassesPerChunk = 64;

// The strengths of the classes so far, class by class.
class Totals {
 public:
  Totals(const CellWeights& weights, Index n_bits)
      : weights_(weights),
        cells_(weights.area.size()),
        views_(weights.strength.size() / cells_),
        shown_(views_ * static_cast<std::size_t>(n_bits)) {
    const auto all = std::accumulate(weights.strength.begin(), weights.strength.end(), std::int64_t{0});
    mean_ = std::max<std::int64_t>(1, all / static_cast<std::int64_t>(shown_.size()));
  }
  // Chooses the cell that the functions below are about.
  void take(std::size_t cell) {
    showing_.clear();
    for (std::size_t v = 0; v < views_; ++v)
      if (const std::int64_t strength = weights_.strength[v * cells_ + cell]; strength > 0)
        showing_.push_back({v, strength});
  }
  // Returns what the cell adds to the utility of a class.
  std::int64_t gain(std::size_t k) const {
    std::int64_t sum = 0;
    for (const auto& [v, strength] : showing_)
      sum += kUnit * strength / (shown_[k * views_ + v] + mean_ / 4 + 1);
    return sum;
  }
  void add_to(std::size_t k) {
    for (const auto& [v, strength] : showing_) shown_[k * views_ + v] += strength;
  }

 private:
  struct Shown {
    std::size_t view;
    std::int64_t strength;
  };
  const CellWeights& weights_;
  std::size_t cells_, views_;
  std::vector<std::int64_t> shown_;
  std::int64_t mean_;
  std::vector<Shown> showing_;  // the views that show the cell
};

}  // namespace

std::vector<std::int32_t> balanced_classes(const CellWeights& weights, const std::vector<std::size_t>& ranked,
                                           Index n_bits) {
  Totals totals(weights, n_bits);
  const auto bits = static_cast<std::size_t>(n_bits);
  std::vector<std::int32_t> classes;
  std::vector<std::size_t> free;
  std::vector<std::int64_t> gains;
  for (const std::size_t cell : ranked) {
    totals.take(cell);
    if (classes.size() < bits) {  // all free classes are empty and gain alike
      totals.add_to(classes.size());
      classes.push_back(static_cast<std::int32_t>(classes.size()));
      continue;
    }
    if (free.empty()) {
      free.resize(bits);
      std::iota(free.begin(), free.end(), std::size_t{0});
    }
    gains.resize(free.size());
    parallel_for(std::ssize(free), kClassesPerChunk, [&](Index begin, Index end) {
      for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i)
        gains[i] = totals.gain(free[i]);
    });
    const auto most = std::max_element(gains.begin(), gains.end()) - gains.begin();
    const std::size_t k = free[static_cast<std::size_t>(most)];
    free.erase(free.begin() + most);
    totals.add_to(k);
    classes.push_back(static_cast<std::int32_t>(k));
  }
  return classes;
}

}  // namespace fieldmark::watermark
