#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/watermark/evidence/evidence.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace fieldmark::watermark {
namespace {
constexpr double kLeast = std::numeric_limits<double>::min();

// Returns the largest |S_c|; dividing the evidence by it keeps squares from overflowing or vanishing.
double check_evidence(std::string_view op, std::span<const double> evidence, const CellCode& code) {
  if (evidence.size() != code.bit.size() || code.sign.size() != code.bit.size()) {
    throw ValueError("[" + std::string(op) + "] evidence: must have " + std::to_string(code.bit.size()) +
                     " entries (the cells of the code), got " + std::to_string(evidence.size()));
  }
  double largest = 0;
  for (std::size_t c = 0; c < evidence.size(); ++c) {
    if (!std::isfinite(evidence[c])) {
      throw ValueError("[" + std::string(op) + "] evidence: entry " + std::to_string(c) +
                       " must be finite, got " + number_text(evidence[c]));
    }
    if (code.bit[c] >= 0) largest = std::max(largest, std::abs(evidence[c]));
  }
  return largest;
}

void check_count(std::string_view op, Index matching, Index n) {
  if (n >= 0 && matching >= 0 && matching <= n) return;
  throw ValueError("[" + std::string(op) + "] matching: must be from 0 to n = " + std::to_string(n) +
                   ", got " + std::to_string(matching));
}

// Returns P(X >= k) for k >= n / 2 (0 above n): C(n, k) / 2^n times a series of falling ratios. Keeps
// mantissa and exponent of the product apart to avoid overflow.
long double upper_tail(Index k, Index n) {
  if (k > n) return 0;
  long double term = 1;
  int exponent = 0;
  for (Index i = 1; i <= n - k; ++i) {
    int shift = 0;
    term = std::frexp(term * static_cast<long double>(k + i) / static_cast<long double>(i), &shift);
    exponent += shift;
  }
  long double sum = 1, ratio = 1;
  for (Index i = k; i < n && ratio > 0; ++i) {
    ratio *= static_cast<long double>(n - i) / static_cast<long double>(i + 1);
    sum += ratio;
  }
  return std::ldexp(term * sum, exponent - static_cast<int>(n));
}

double at_least_normal(long double p) { return std::max(static_cast<double>(p), kLeast); }
}  // namespace

double keyed_statistic(std::span<const double> evidence, const CellCode& code, const Message& message) {
  const double largest = check_evidence("keyed_statistic", evidence, code);
  const std::vector<std::int8_t> signs = cell_signs(code, message);
  if (largest == 0) return 0;
  double sum = 0, squares = 0;
  for (std::size_t c = 0; c < signs.size(); ++c) {
    if (signs[c] == 0) continue;
    const double s = evidence[c] / largest;
    sum += s * signs[c];
    squares += s * s;
  }
  return sum / std::sqrt(squares);
}

double keyed_p_value(double statistic) {
  if (std::isnan(statistic)) throw ValueError("[keyed_p_value] statistic must be a number, got nan");
  return statistic > 0 ? std::max(std::exp(-0.5 * statistic * statistic), kLeast) : 1;
}

double sharp_p_value(double statistic) {
  const auto twice_q = [](double t) { return std::erfc(t / std::numbers::sqrt2); };
  const double p = keyed_p_value(statistic);
  if (statistic <= 0) return p;
  return std::max(std::min(p, twice_q(statistic) / (4 * twice_q(std::numbers::sqrt2))), kLeast);
}

double keyed_p_value_two_sided(double statistic) {
  return std::min(1.0, 2 * keyed_p_value(std::abs(statistic)));
}

double least_p(Index carriers) {
  if (carriers < 0)
    throw ValueError("[least_p] carriers must be at least 0, got " + std::to_string(carriers));
  return std::max(std::exp(-0.5 * static_cast<double>(carriers)), kLeast);
}

double least_p(std::span<const double> evidence, const CellCode& code) {
  const double largest = check_evidence("least_p", evidence, code);
  if (largest == 0) return 1;
  double sum = 0, squares = 0;
  for (std::size_t c = 0; c < evidence.size(); ++c) {
    if (code.bit[c] < 0) continue;
    const double s = std::abs(evidence[c]) / largest;
    sum += s;
    squares += s * s;
  }
  return keyed_p_value(sum / std::sqrt(squares));
}

BitReading read_bits(std::span<const double> evidence, const CellCode& code, Index n_bits) {
  if (n_bits < 1) throw ValueError("[read_bits] n_bits must be at least 1, got " + std::to_string(n_bits));
  const double largest = check_evidence("read_bits", evidence, code);
  const auto n = static_cast<std::size_t>(n_bits);
  BitReading reading{std::vector<double>(n),
                     std::vector<double>(n),
                     {std::vector<std::uint8_t>(n)},
                     std::vector<std::uint8_t>(n)};
  std::vector<double> squares(n);
  for (std::size_t c = 0; c < evidence.size(); ++c) {
    if (code.bit[c] < 0) continue;
    if (code.bit[c] >= n_bits) {
      throw ValueError("[read_bits] code: the bit of cell " + std::to_string(c) + " must be below n_bits = " +
                       std::to_string(n_bits) + ", got " + std::to_string(code.bit[c]));
    }
    const auto b = static_cast<std::size_t>(code.bit[c]);
    const double s = largest > 0 ? evidence[c] / largest : 0;
    reading.sum[b] += s * code.sign[c];
    squares[b] += s * s;
  }
  for (std::size_t b = 0; b < n; ++b) {
    if (squares[b] > 0) reading.logit[b] = reading.sum[b] / std::sqrt(squares[b]);
    reading.message.bits[b] = reading.logit[b] > 0;
    reading.decided[b] = reading.logit[b] != 0;
  }
  return reading;
}

double BitMatch::accuracy() const {
  return (static_cast<double>(matching) + 0.5 * static_cast<double>(bits - decided)) /
         static_cast<double>(bits);
}

BitMatch match_bits(const BitReading& reading, const Message& message) {
  if (reading.message.size() != message.size()) {
    throw ValueError("[match_bits] reading: must have " + std::to_string(message.size()) +
                     " bits (the message's length), got " + std::to_string(reading.message.size()));
  }
  BitMatch match;
  match.bits = message.size();
  for (std::size_t b = 0; b < message.bits.size(); ++b) {
    match.decided += reading.decided[b];
    match.matching += reading.decided[b] && reading.message.bits[b] == message.bits[b];
  }
  return match;
}

double p_value_bits(Index matching, Index n) {
  check_count("p_value_bits", matching, n);
  if (2 * matching >= n) return at_least_normal(upper_tail(matching, n));
  // P(X >= k) = 1 - P(X <= k - 1) = 1 - P(X >= n - k + 1). The last term is at most 1/2, so nothing cancels.
  return at_least_normal(1 - upper_tail(n - matching + 1, n));
}

double p_value_bits_two_sided(Index matching, Index n) {
  check_count("p_value_bits_two_sided", matching, n);
  if (2 * matching == n) return 1;
  return std::min(1.0, 2 * p_value_bits(std::max(matching, n - matching), n));
}

Index least_matching_bits(Index n, double rate) {
  if (n < 0) throw ValueError("[least_matching_bits] n must be at least 0, got " + std::to_string(n));
  if (!(rate > 0 && rate <= 1)) {
    throw ValueError("[least_matching_bits] rate must be in (0, 1], got " + number_text(rate));
  }
  Index low = 0, high = n + 1;  // p(low - 1) > rate >= p(high), with p(n + 1) = 0
  while (low < high) {
    const Index middle = low + (high - low) / 2;
    if (p_value_bits(middle, n) <= rate)
      high = middle;
    else
      low = middle + 1;
  }
  return low;
}

EvidenceScore score_evidence(std::span<const double> evidence, const CellCode& code, const Message& message) {
  EvidenceScore score;
  score.statistic = keyed_statistic(evidence, code, message);
  score.p_value = keyed_p_value(score.statistic);
  score.p_value_two_sided = keyed_p_value_two_sided(score.statistic);
  score.reading = read_bits(evidence, code, message.size());
  score.match = match_bits(score.reading, message);
  score.p_value_bits = p_value_bits(score.match.matching, score.match.decided);
  score.p_value_bits_two_sided = p_value_bits_two_sided(score.match.matching, score.match.decided);
  return score;
}

std::vector<double> bit_p_values(const BitReading& reading) {
  std::vector<double> p;
  for (double logit : reading.logit) p.push_back(keyed_p_value_two_sided(logit));
  return p;
}

Index contradicting_bits(const BitReading& reading, const Message& message) {
  if (reading.message.bits.size() != message.bits.size())
    throw ShapeError("[contradicting_bits] message must have the " +
                     std::to_string(reading.message.bits.size()) + " bits of the reading, got " +
                     std::to_string(message.bits.size()));
  const double most = 0.01 / static_cast<double>(message.bits.size());
  const std::vector<double> p = bit_p_values(reading);
  Index against = 0;
  for (std::size_t b = 0; b < p.size(); ++b)
    against += reading.decided[b] && reading.message.bits[b] != message.bits[b] && p[b] <= most;
  return against;
}

}  // namespace fieldmark::watermark
