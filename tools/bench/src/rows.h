#pragma once
// The rows of the engine benchmark, one file per kind. Private.
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/engine/shape.h>
#include <fieldmark/tools/bench/engine_bench.h>
#include "timing.h"

namespace fieldmark::bench {

struct RowOptions : EngineBenchOptions {
  std::function<void()> between{};  // for time_calls(), in rows with a peer
};

using RowRun = std::function<EngineRow(const RowOptions&)>;
struct RowSpec {
  std::string name, what;
  RowRun run;  // everything except name, megabytes and peer; what: the spec's if empty
  std::function<SafetensorsFile(const RowOptions&)> work{};  // for a peer, see peer_work(); empty: no peer
};

std::vector<RowSpec> chain_rows();
std::vector<RowSpec> mlp_rows();
std::vector<RowSpec> conv_rows();
std::vector<RowSpec> model_rows();
std::vector<RowSpec> hash_rows();
std::vector<RowSpec> nerf_rows();

inline EngineRow row_of(const Timing& t, double operations, double items) {
  EngineRow row;
  row.seconds = t.seconds;
  row.spread = (t.most - t.least) / t.seconds;
  row.gflops = operations / t.seconds * 1e-9;
  row.ratio_to_peak = operations / t.peak_operations;
  row.rate = items / t.seconds;
  return row;
}

// Fixed numbers in [-1, 1) without a pattern that a cache could exploit.
template <class T>
std::vector<T> numbers(Index n, std::uint64_t seed) {
  std::vector<T> out(static_cast<std::size_t>(n));
  std::uint64_t s = seed * 2654435761u + 1;
  for (T& v : out) {
    s = s * 6364136223846793005u + 1442695040888963407u;
    v = static_cast<T>(static_cast<float>(s >> 40) * 0x1p-23f - 1);
  }
  return out;
}

// Worst |a - b| relative to the largest magnitude |b|; NaN counts as infinite.
template <class A, class B>
double relative_error(const A& a, const B& b) {
  double worst = 0, largest = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    const double x = static_cast<double>(a[i]), y = static_cast<double>(b[i]);
    const double difference = x < y ? y - x : x - y;
    worst = difference <= worst ? worst : difference == difference ? difference : 1e300;
    largest = y > largest ? y : -y > largest ? -y : largest;
  }
  return largest > 0 ? worst / largest : worst;
}

}  // namespace fieldmark::bench
