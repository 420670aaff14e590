#include <fieldmark/watermark/reading/joint_evidence.h>

#include <fieldmark/core/error.h>

#include <cmath>
#include <limits>
#include <utility>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("joint_evidence: the extractor counts as far as it agrees with the residual") {
  // Unit vectors with correlation 0.6, at other powers: (1, 0) and (0.6, 0.8).
  const auto joint = joint_evidence({3, 4}, {0.5, 0});
  const double length = std::sqrt(1 + 3 * 0.36);
  CHECK(joint[0] == Approx(5 * (1 + 0.6 * 0.6) / length).epsilon(1e-14));
  CHECK(joint[1] == Approx(5 * 0.6 * 0.8 / length).epsilon(1e-14));
  CHECK(std::hypot(joint[0], joint[1]) == Approx(5).epsilon(1e-14));
}

TEST_CASE("joint_evidence: trust multiplies the extractor's share, up to 1") {
  for (const auto& [trust, share] : {std::pair{0., 0.}, {0.5, 0.3}, {1.5, 0.9}, {2., 1.}, {9., 1.}}) {
    CAPTURE(trust);
    const auto joint = joint_evidence({3, 4}, {0.5, 0}, trust);
    const double length = std::hypot(1 + share * 0.6, share * 0.8);
    CHECK(joint[0] == Approx(5 * (1 + share * 0.6) / length).epsilon(1e-14));
    CHECK(joint[1] == Approx(5 * share * 0.8 / length).margin(1e-14));
  }
  CHECK(joint_evidence({0, 2}, {1, 0}, 9) == std::vector<double>{2, 0});
}

TEST_CASE("joint_evidence: an extractor that reads nothing or the contrary adds nothing") {
  CHECK(joint_evidence({0, 2}, {1, 0}) == std::vector<double>{2, 0});
  CHECK(joint_evidence({-2, 0}, {1, 0}) == std::vector<double>{2, 0});
  CHECK(joint_evidence({0, 0}, {1, 3}) == std::vector<double>{1, 3});
  CHECK(joint_evidence({1, 3}, {0, 0}) == std::vector<double>{0, 0});
}

TEST_CASE("joint_evidence: evidence is scaled to the power of other evidence") {
  CHECK(scaled_to({3, 4}, {0, 2}) == std::vector<double>{0, 5});
  CHECK(scaled_to({0, 0}, {1, 2}) == std::vector<double>{1, 2});
  CHECK(scaled_to({1, 2}, {0, 0}) == std::vector<double>{0, 0});
}

TEST_CASE("joint_evidence: errors") {
  CHECK_THROWS_AS(joint_evidence({1, 2}, {1}), ShapeError);
  CHECK_THROWS_WITH(joint_evidence({1}, {1}, -1), Contains("trust must be at least 0, got -1"));
  CHECK_THROWS_AS(joint_evidence({1}, {1}, std::numeric_limits<double>::quiet_NaN()), ValueError);
  CHECK_THROWS_WITH(joint_evidence({1, 2}, {1}), Contains("as many cells, got 2 and 1"));
}
