#include <fieldmark/watermark/evidence/evidence_score.h>

namespace fieldmark::watermark {

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

std::vector<double> bit_confidence(const BitReading& reading) {
  std::vector<double> confidence;
  for (double logit : reading.logit) confidence.push_back(1 - keyed_p_value_two_sided(logit));
  return confidence;
}

}  // namespace fieldmark::watermark
