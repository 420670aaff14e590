#pragma once
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/payload/message.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

// S_c is the evidence of cell c, summed over the pixels of one image or of many views and tested once. It
// must come from the images alone: neither camera search nor choice of detector may know key or message.

/// Correlates the evidence with the signs of a message under a key, over the cells that carry a bit.
///   T = sum_c S_c s_c / sqrt(sum_c S_c^2),   s_c = (2 M[bit_c] - 1) sign_c
/// @param evidence  [cells] S_c, finite, any scale
/// @return T, |T| <= sqrt(cells that carry a bit); 0 without evidence
/// @throws ValueError if the sizes differ, an entry is not finite, or a bit lies outside the message
double keyed_statistic(std::span<const double> evidence, const CellCode& code, const Message& message);

/// Bounds the probability that a key drawn independently of the image reaches T. The bound holds for any
/// image.
///   p = exp(-T^2 / 2) for T > 0, else 1
/// Source: Hoeffding 1963, theorem 2, for the sum of S_c s_c with fair independent signs. At least the
/// smallest normal double, never 0.   @throws ValueError if T is NaN
double keyed_p_value(double statistic);

/// Bounds the same probability more sharply for T > 0.7, by a factor of 0.39 at T = 3 and 0.18 at T = 7.
///   p = min(exp(-T^2 / 2), Q(T) / (4 Q(sqrt 2))) for T > 0, else 1;   Q(T) = P(N(0, 1) >= T)
/// Source: Bentkus and Dzindzalieta 2015, A tight Gaussian bound for weighted sums of Rademacher random
/// variables. At least the smallest normal double, never 0.   @throws ValueError if T is NaN
double sharp_p_value(double statistic);

/// Two-sided bound for |T|, since a thief may flip every sign.   p = min(1, 2 exp(-T^2 / 2))
double keyed_p_value_two_sided(double statistic);

/// Returns the least p-value that this many cells can reach: exp(-cells / 2), since T^2 <= cells
/// (Cauchy-Schwarz). No image can meet a lower rate of false alarms.   @throws ValueError if carriers < 0
double least_p(Index carriers);

/// Bounds the p-value of this evidence under any key from below, by T <= sum |S_c| / sqrt(sum S_c^2).
/// @throws ValueError as keyed_statistic
double least_p(std::span<const double> evidence, const CellCode& code);

/// The message read from the evidence.
struct BitReading {
  /// [bits] L_b = sum_{c: bit_c = b} sign_c S_c / sqrt(sum_{c: bit_c = b} S_c^2): mean 0 and variance 1 under
  /// an independent key; 0 without evidence.
  std::vector<double> logit;
  /// [bits] sum_{c: bit_c = b} sign_c S_c / max_c |S_c|: small for a bit that is hardly in view, which makes
  /// it the weight for PayloadCodec::read(). Under an independent key its signs are fair, given the
  /// magnitudes.
  std::vector<double> sum;
  /// [bits] 1 where the logit is positive, else 0.
  Message message;
  /// [bits] 1 where the logit is not 0; an undecided bit counts as half right.
  std::vector<std::uint8_t> decided;
};

/// Reads the message.   @param evidence  [cells]   @param n_bits  length of the message, at least 1
/// @throws ValueError if the sizes differ, an entry is not finite, or a bit of the code is not below n_bits
BitReading read_bits(std::span<const double> evidence, const CellCode& code, Index n_bits);

/// Agreement of a reading with a message.
struct BitMatch {
  Index matching = 0;  ///< among the decided bits
  Index decided = 0;   ///< bits whose logit is not 0
  Index bits = 0;      ///< length of the message
  /// (matching + undecided / 2) / bits
  double accuracy() const;
};

/// Compares a reading with a message.   @throws ValueError if their numbers of bits differ
BitMatch match_bits(const BitReading& reading, const Message& message);

/// Returns the probability that at least `matching` of n fair bits match: P(X >= matching),
/// X ~ Binomial(n, 1/2).
/// Exact for a reading under an independent key if n counts the decided bits, whose signs are then fair and
/// independent. Relative error below 1e-15 for n up to 1e4; never 0 (see keyed_p_value).
/// @param matching  0 to n   @throws ValueError otherwise
double p_value_bits(Index matching, Index n);

/// Returns the two-sided probability P(|X - n/2| >= |matching - n/2|).
/// @param matching  0 to n   @throws ValueError otherwise
double p_value_bits_two_sided(Index matching, Index n);

/// Returns the least number of matching bits with p_value_bits <= rate; n + 1 if n bits do not suffice.
/// @param rate  of false alarms, in (0, 1]   @throws ValueError if n < 0 or the rate is outside
Index least_matching_bits(Index n, double rate);

/// All results of testing evidence for one message under one key.
struct EvidenceScore {
  double statistic = 0;               ///< T, keyed_statistic()
  double p_value = 1;                 ///< keyed_p_value()
  double p_value_two_sided = 1;       ///< keyed_p_value_two_sided()
  double p_value_bits = 1;            ///< p_value_bits() of the decided bits
  double p_value_bits_two_sided = 1;  ///< p_value_bits_two_sided() of the decided bits
  BitReading reading{};               ///< independent of the message
  BitMatch match{};                   ///< of the reading with the message
};

/// Tests evidence for a message under a key.
/// @param evidence  [cells]   @throws ValueError as keyed_statistic()
EvidenceScore score_evidence(std::span<const double> evidence, const CellCode& code, const Message& message);

/// Computes the p-value of each bit by itself: a bound on the probability that an independent key gives a
/// logit of at least this magnitude (Hoeffding). It is not the probability that the bit is wrong.
///   p_b = min(1, 2 exp(-L_b^2 / 2))
/// @return [bits] in (0, 1]; 1 below |L_b| = 1.18
std::vector<double> bit_p_values(const BitReading& reading);

/// Returns the number of bits that contradict a message: decided otherwise, with a bit_p_values() of at most
/// 0.01 / N. A mark with another message gives such bits; noise gives one with a probability of at most 0.01.
/// @throws ShapeError unless the message has as many bits as the reading
Index contradicting_bits(const BitReading& reading, const Message& message);

}  // namespace fieldmark::watermark
