#pragma once
#include <fieldmark/watermark/evidence/evidence.h>

#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Everything that a test of summed evidence for a message under a key says (see evidence.h).
struct EvidenceScore {
  double statistic = 0;               ///< T, keyed_statistic()
  double p_value = 1;                 ///< keyed_p_value()
  double p_value_two_sided = 1;       ///< keyed_p_value_two_sided()
  double p_value_bits = 1;            ///< p_value_bits() of the decided bits
  double p_value_bits_two_sided = 1;  ///< p_value_bits_two_sided() of the decided bits
  BitReading reading{};               ///< what was read, whatever the message
  BitMatch match{};                   ///< of the reading with the message
};

/// @param evidence  [cells]   @throws ValueError as keyed_statistic()
EvidenceScore score_evidence(std::span<const double> evidence, const CellCode& code, const Message& message);

/// How sure each bit is: one minus a bound on the probability that a key drawn independently of the image
/// gives a logit at least as large, in either direction (Hoeffding, as keyed_p_value_two_sided()).
///   1 - min(1, 2 exp(-L_b^2 / 2))
/// @return [bits] in [0, 1]; 0 below |L_b| = 1.18
std::vector<double> bit_confidence(const BitReading& reading);

}  // namespace fieldmark::watermark
