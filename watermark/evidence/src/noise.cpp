#include <fieldmark/core/error.h>
#include <fieldmark/watermark/evidence/noise.h>

#include <cmath>
#include <limits>
#include <string>

namespace fieldmark::watermark {
namespace {

double chi_squared_bound(double power, double n) {
  if (!(power > n)) return 1;
  constexpr double kSmallest = std::numeric_limits<double>::min();
  const double p = std::exp(0.5 * (n * std::log(power / n) + n - power));
  return p > kSmallest ? p : kSmallest;  // also for an infinite power
}

}  // namespace

double noise_p_value(const BitReading& reading) {
  double power = 0;
  for (double logit : reading.logit) power += logit * logit;
  return chi_squared_bound(power, static_cast<double>(reading.logit.size()));
}

double least_noise_p(Index carriers, Index n_bits) {
  if (carriers < 0 || n_bits < 1)
    throw ValueError("[least_noise_p] carriers must be at least 0 and n_bits at least 1, got " +
                     std::to_string(carriers) + " and " + std::to_string(n_bits));
  return chi_squared_bound(static_cast<double>(carriers), static_cast<double>(n_bits));
}

}  // namespace fieldmark::watermark
