#include <fieldmark/core/error.h>
#include <fieldmark/watermark/evidence/evidence_score.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Eight cells, two for each of four bits; the last bit of the message is read wrongly, the third not at all.
const CellCode kCode{{0, 0, 1, 1, 2, 2, 3, 3}, {1, -1, 1, -1, 1, -1, 1, -1}};
const Message kMessage{{1, 0, 1, 0}};
const std::vector<double> kEvidence{2, -1, -2, 2, 0, 0, 1, 0};
}  // namespace

TEST_CASE("evidence_score: every figure, by hand") {
  const EvidenceScore score = score_evidence(kEvidence, kCode, kMessage);
  // sum S_c s_c = 2 + 1 + 2 + 2 - 1 = 6, sum S_c^2 = 4 + 1 + 4 + 4 + 1 = 14
  const double t = 6 / std::sqrt(14.);
  CHECK(score.statistic == Approx(t));
  CHECK(score.p_value == Approx(std::exp(-t * t / 2)));
  CHECK(score.p_value_two_sided == Approx(2 * std::exp(-t * t / 2)));
  CHECK(score.reading.message == Message{{1, 0, 0, 1}});
  CHECK(score.match.matching == 2);
  CHECK(score.match.decided == 3);
  CHECK(score.p_value_bits == Approx(0.5));  // 4 of the 8 outcomes of three coins
  CHECK(score.p_value_bits_two_sided == Approx(1));
}

TEST_CASE("evidence_score: a bit is as sure as its logit is large") {
  const auto confidence = bit_confidence(score_evidence(kEvidence, kCode, kMessage).reading);
  REQUIRE(confidence.size() == 4);
  CHECK(confidence[0] == Approx(1 - 2 * std::exp(-0.9)));  // L = 3 / sqrt 5
  CHECK(confidence[1] == Approx(1 - 2 * std::exp(-1.0)));  // L = -4 / sqrt 8
  CHECK(confidence[2] == 0);
  CHECK(confidence[3] == 0);
}

TEST_CASE("evidence_score: sizes that do not fit are named") {
  CHECK_THROWS_WITH(score_evidence(std::vector<double>(3), kCode, kMessage), Contains("must have 8 entries"));
}
