#pragma once
#include <fieldmark/watermark/attacks/payload_trials.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// Options of run_payload_bench().
struct PayloadBenchOptions {
  Index bits = 100;            ///< of a message, 1 to 256
  Index trials = 1000;         ///< per row, at least 1
  Index noise_trials = 10000;  ///< readings of fair bits, at least 1
  std::vector<double> error_rates = {0.0,  0.01, 0.02, 0.03, 0.04, 0.05,
                                     0.06, 0.07, 0.08, 0.09, 0.10};  ///< of raw bits, in [0, 1/2)
  std::uint64_t seed = 0;                                            ///< of payloads and errors
};

/// How often random payloads of random_payload_bits() are read at one raw bit error rate. Logits are +-m +
/// normal noise of deviation 1, with m = -Phi^-1(rate), so that a sign is wrong with this rate; rate 0 has no
/// noise.
struct PayloadRow {
  double error_rate = 0;  ///< of raw bits
  double computed =
      0;  ///< fraction with at most PayloadLayout::corrects errors: P(Binomial(n, rate) <= corrects)
  watermark::PayloadAccuracy signs;      ///< using the signs alone
  watermark::PayloadAccuracy strengths;  ///< using the logits
};

/// How often random messages are read as a payload.
struct PayloadNoise {
  Index trials = 0;     ///< readings of fair bits
  Index signs = 0;      ///< those read as a payload from signs alone
  Index strengths = 0;  ///< those read as a payload from normally distributed logits
  double bound = 0;     ///< PayloadCodec::chance()
};

/// Payload accuracy under simulated errors.
struct PayloadBench {
  Index data_bits = 0;                            ///< of the random payloads
  std::vector<watermark::PayloadLayout> layouts;  ///< of messages of this length
  std::vector<PayloadRow> rows;                   ///< one per rate
  PayloadNoise noise;                             ///< of messages of this length
};

/// Runs the benchmark; the results do not depend on the number of threads. @param progress  called with the
/// fraction done, before each row
/// @throws ValueError if an option is out of range, or messages of this length hold no payload
PayloadBench run_payload_bench(
    const PayloadBenchOptions& options,
    const std::function<void(const std::string& what, double part)>& progress = {});

}  // namespace fieldmark::bench
