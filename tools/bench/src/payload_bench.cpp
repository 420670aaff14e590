#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/tools/bench/payload_bench.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::bench {
namespace {

using watermark::PayloadCodec;
using watermark::PayloadTrials;

constexpr Index kTrialsAtOnce = 16;

double normal_tail(double x) { return std::erfc(x / std::sqrt(2.0)) / 2; }

// Returns m with P(normal number > m) = rate, for rate in (0, 1/2).
double strength_of(double rate) {
  double low = 0, high = 40;
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    (normal_tail(middle) > rate ? low : high) = middle;
  }
  return low;
}

double at_most(Index errors, Index n, double rate) {
  double sum = 0, term = std::pow(1 - rate, static_cast<double>(n));
  for (Index i = 0; i <= errors; ++i) {
    sum += term;
    term *= rate / (1 - rate) * static_cast<double>(n - i) / static_cast<double>(i + 1);
  }
  return std::min(sum, 1.0);
}

std::vector<double> signs_of(std::vector<double> logits) {
  for (double& x : logits) x = x > 0 ? 1.0 : -1.0;
  return logits;
}

void add(watermark::PayloadAccuracy& sum, const watermark::PayloadAccuracy& a) {
  sum.trials += a.trials;
  sum.exact += a.exact;
  sum.wrong += a.wrong;
  sum.corrected += a.corrected;
}

// Calls f(trial, result) for all trials on several threads; each chunk of trials has its own result.
template <class Result, class F>
std::vector<Result> over_trials(Index trials, const Result& empty, F&& f) {
  std::vector<Result> pieces(static_cast<std::size_t>((trials + kTrialsAtOnce - 1) / kTrialsAtOnce), empty);
  parallel_for(trials, kTrialsAtOnce, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i)
      f(static_cast<std::uint64_t>(i), pieces[static_cast<std::size_t>(begin / kTrialsAtOnce)]);
  });
  return pieces;
}

PayloadRow run_row(const PayloadBenchOptions& options, const PayloadCodec& codec, double rate,
                   std::uint64_t stream) {
  const CounterRng payloads(options.seed, stream), errors(options.seed, stream + 1);
  const double magnitude = rate > 0 ? strength_of(rate) : 1, noise = rate > 0 ? 1 : 0;
  struct Pair {
    PayloadTrials signs, strengths;
  };
  const auto pieces = over_trials(
      options.trials, Pair{PayloadTrials(codec), PayloadTrials(codec)}, [&](std::uint64_t i, Pair& pair) {
        const auto sent = watermark::random_payload(codec, payloads, i);
        std::vector<double> logits;
        for (auto bit : codec.encode(sent).bits)
          logits.push_back((bit ? magnitude : -magnitude) +
                           noise * static_cast<double>(errors.normal2(i, logits.size())[0]));
        pair.strengths.add(logits, sent);
        pair.signs.add(signs_of(std::move(logits)), sent);
      });
  PayloadRow row{.error_rate = rate, .computed = 0, .signs = {}, .strengths = {}};
  for (const Pair& piece : pieces) {
    add(row.signs, piece.signs.accuracy());
    add(row.strengths, piece.strengths.accuracy());
  }
  const Index data_bits = watermark::random_payload_bits(codec);
  for (const auto& l : codec.layouts())
    if (l.data_bits == data_bits) row.computed = at_most(l.corrects, options.bits - l.spare_bits, rate);
  return row;
}

PayloadNoise run_noise(const PayloadBenchOptions& options, const PayloadCodec& codec) {
  const CounterRng rng(options.seed, 91);
  PayloadNoise noise{.trials = options.noise_trials, .signs = 0, .strengths = 0, .bound = codec.chance()};
  const auto pieces =
      over_trials(options.noise_trials, PayloadNoise{}, [&](std::uint64_t i, PayloadNoise& piece) {
        std::vector<double> logits(static_cast<std::size_t>(options.bits));
        for (std::size_t b = 0; b < logits.size(); ++b) logits[b] = static_cast<double>(rng.normal2(i, b)[0]);
        piece.strengths += codec.read(logits).has_value();
        piece.signs += codec.read(signs_of(std::move(logits))).has_value();
      });
  for (const PayloadNoise& piece : pieces) {
    noise.signs += piece.signs;
    noise.strengths += piece.strengths;
  }
  return noise;
}

}  // namespace

PayloadBench run_payload_bench(const PayloadBenchOptions& options,
                               const std::function<void(const std::string&, double)>& progress) {
  if (options.trials < 1 || options.noise_trials < 1)
    throw ValueError("[run_payload_bench] trials must be at least 1, got " + std::to_string(options.trials) +
                     " and " + std::to_string(options.noise_trials));
  for (double rate : options.error_rates)
    if (!(rate >= 0 && rate < 0.5))
      throw ValueError("[run_payload_bench] error_rates must be in [0, 0.5), got " + number_text(rate));
  const PayloadCodec codec(options.bits);
  watermark::random_payload(codec, CounterRng(0), 0);  // throws if messages hold no payload
  PayloadBench bench{watermark::random_payload_bits(codec), codec.layouts(), {}, {}};
  const double parts = static_cast<double>(options.error_rates.size() + 1);
  for (std::size_t i = 0; i < options.error_rates.size(); ++i) {
    if (progress) progress("errors", static_cast<double>(i) / parts);
    bench.rows.push_back(run_row(options, codec, options.error_rates[i], 100 + 2 * i));
  }
  if (progress) progress("fair bits", 1 - 1 / parts);
  bench.noise = run_noise(options, codec);
  return bench;
}

}  // namespace fieldmark::bench
