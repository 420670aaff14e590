#pragma once
#include <fieldmark/watermark/mark/cell_code.h>
#include <fieldmark/watermark/payload/message.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

// In all of this unit S_c is the summed sign evidence of cell c: added over the pixels of one image, or of
// many views of one model, then tested once. It must come from the image alone: whatever produced it
// (camera search, choice of reading) may not have looked at key or message.

/// How far the evidence leans towards a message under a key.
///   T = sum_c S_c s_c / sqrt(sum_c S_c^2),   s_c = (2 M[bit_c] - 1) sign_c,   over the cells that carry a
///   bit
/// @param evidence  [cells] S_c, finite, any scale
/// @return T, |T| <= sqrt(cells that carry a bit); 0 without evidence
/// @throws ValueError if the sizes differ, an entry is not finite, or a bit lies outside the message
double keyed_statistic(std::span<const double> evidence, const CellCode& code, const Message& message);

/// Bound on the probability that a key drawn independently of the image reaches T, exact for any image.
///   p = exp(-T^2 / 2) for T > 0, else 1
/// Source: Hoeffding 1963, theorem 2, for the sum of S_c s_c with fair independent signs. Where it would
/// underflow it is the least normal double: never 0.   @throws ValueError if T is not a number
double keyed_p_value(double statistic);

/// The same for |T|: a thief may flip every sign.   p = min(1, 2 exp(-T^2 / 2))
double keyed_p_value_two_sided(double statistic);

/// Least p-value that any image can reach with this many cells: exp(-cells / 2), since T^2 <= cells
/// (Cauchy-Schwarz). A rate of false alarms below it can never be met.   @throws ValueError if carriers < 0
double least_p(Index carriers);

/// Least p-value that this evidence can reach under any key, by T <= sum |S_c| / sqrt(sum S_c^2).
/// @throws ValueError as keyed_statistic
double least_p(std::span<const double> evidence, const CellCode& code);

/// The message read from the evidence.
struct BitReading {
  /// [bits] L_b = sum_{c: bit_c = b} sign_c S_c / sqrt(sum_{c: bit_c = b} S_c^2): mean 0 and variance 1 under
  /// a key that has nothing to do with the image; 0 without evidence.
  std::vector<double> logit;
  /// [bits] sum_{c: bit_c = b} sign_c S_c / max_c |S_c|: the same, but a bit that the image shows little of
  /// is small. What PayloadCodec::read() should weigh bits by; under such a key its signs are fair too, given
  /// the sizes.
  std::vector<double> sum;
  /// [bits] 1 where the logit is positive, else 0.
  Message message;
  /// [bits] 1 where the logit is not 0; an undecided bit counts as half right.
  std::vector<std::uint8_t> decided;
};

/// @param evidence  [cells]   @param n_bits  length of the message, at least 1
/// @throws ValueError if the sizes differ, an entry is not finite, or a bit of the code is not below n_bits
BitReading read_bits(std::span<const double> evidence, const CellCode& code, Index n_bits);

/// How many bits of a reading agree with a message.
struct BitMatch {
  Index matching = 0;  ///< among the decided bits
  Index decided = 0;   ///< bits whose logit is not 0
  Index bits = 0;      ///< length of the message
  /// (matching + undecided / 2) / bits
  double accuracy() const;
};

/// @throws ValueError if the reading has another number of bits than the message
BitMatch match_bits(const BitReading& reading, const Message& message);

/// Probability of at least `matching` of n fair bits: P(X >= matching), X ~ Binomial(n, 1/2).
/// Exact for a reading under an independent key when n counts its decided bits: given the sizes of the
/// logits, their signs are fair and independent. Relative error below 1e-15 for n to 1e4; never 0 (see
/// keyed_p_value).
/// @param matching  0 to n   @throws ValueError otherwise
double p_value_bits(Index matching, Index n);

/// P(|X - n/2| >= |matching - n/2|): as surprising in either direction.
/// @param matching  0 to n   @throws ValueError otherwise
double p_value_bits_two_sided(Index matching, Index n);

/// Least number of matching bits with p_value_bits <= rate; n + 1 if all n bits do not suffice.
/// @param rate  of false alarms, in (0, 1]   @throws ValueError if n < 0 or the rate is outside
Index least_matching_bits(Index n, double rate);

}  // namespace fieldmark::watermark
