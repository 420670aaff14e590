#include <fieldmark/engine/tensor_stats.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace fieldmark {

void TensorStats::merge(const TensorStats& other) {
  const auto mine = static_cast<double>(count - nonfinite);
  const auto theirs = static_cast<double>(other.count - other.nonfinite);
  if (theirs > 0) {
    // Weighted before summing: neither sums nor squares of values near the end of the range may overflow.
    const double w = mine / (mine + theirs), v = theirs / (mine + theirs);
    mean = w * mean + v * other.mean;
    rms = std::hypot(std::sqrt(w) * rms, std::sqrt(v) * other.rms);
    largest = std::max(largest, other.largest);
  }
  count += other.count;
  zeros += other.zeros;
  nonfinite += other.nonfinite;
}

template <class T>
TensorStats tensor_stats(std::string name, std::span<const T> elements) {
  TensorStats s{.name = std::move(name), .count = static_cast<Index>(elements.size())};
  for (const T x : elements) {
    if (!std::isfinite(x)) {
      ++s.nonfinite;
      continue;
    }
    s.zeros += x == T(0) ? 1 : 0;
    s.largest = std::max(s.largest, std::abs(static_cast<double>(x)));
  }
  if (s.largest == 0) return s;
  // Scaled by the largest magnitude, so that sums and squares neither overflow nor vanish.
  double sum = 0, squares = 0;
  for (const T x : elements) {
    if (!std::isfinite(x)) continue;
    const double r = static_cast<double>(x) / s.largest;
    sum += r;
    squares += r * r;
  }
  const auto finite = static_cast<double>(s.count - s.nonfinite);
  s.mean = s.largest * (sum / finite);
  s.rms = s.largest * std::sqrt(squares / finite);
  return s;
}

template <class T>
std::vector<TensorStats> gradient_stats(ParamStore<T>& store) {
  std::vector<TensorStats> stats;
  for (const auto& e : store.entries())
    if (is_trained(e.role))
      stats.push_back(tensor_stats(e.name, std::span<const T>(store.grads(store.find(e.name)))));
  return stats;
}

template <class T>
std::vector<TensorStats> value_stats(const ParamStore<T>& store) {
  std::vector<TensorStats> stats;
  for (const auto& e : store.entries())
    stats.push_back(tensor_stats(e.name, store.values(store.find(e.name))));
  return stats;
}

std::string stats_table(std::span<const TensorStats> stats) {
  std::size_t width = 22;
  for (const TensorStats& s : stats) width = std::max(width, s.name.size());
  const auto padded = [width](std::string text) {
    text.resize(width, ' ');
    return text;
  };
  std::string text =
      padded("name") + "   elements        mean         rms     largest   zero %  not finite\n";
  for (const TensorStats& s : stats) {
    char line[120];
    std::snprintf(line, sizeof line, " %10lld %11.3e %11.3e %11.3e %8.2f %11lld\n",
                  static_cast<long long>(s.count), s.mean, s.rms, s.largest, 100 * s.zero_fraction(),
                  static_cast<long long>(s.nonfinite));
    text += padded(s.name) + line;
  }
  return text;
}

template TensorStats tensor_stats(std::string, std::span<const float>);
template TensorStats tensor_stats(std::string, std::span<const double>);
template std::vector<TensorStats> gradient_stats(ParamStore<float>&);
template std::vector<TensorStats> gradient_stats(ParamStore<double>&);
template std::vector<TensorStats> value_stats(const ParamStore<float>&);
template std::vector<TensorStats> value_stats(const ParamStore<double>&);

}  // namespace fieldmark
