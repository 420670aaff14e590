#include <fieldmark/core/error.h>
#include <fieldmark/imaging/pareto.h>

#include <cmath>
#include <limits>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
std::vector<bool> front(std::vector<SpeedQuality> points, const ParetoMargin& margin = {0, 0}) {
  return pareto_front(points, margin);
}
}  // namespace

TEST_CASE("pareto: what another point beats is not on the front") {
  //          exact and slow, quick and coarse, slower and coarser than the one before, in the middle
  CHECK(front({{4, 60}, {1, 30}, {2, 29}, {2, 45}}) == std::vector<bool>{true, true, false, true});
  CHECK(front({{1, 30}, {1, 30}}) == std::vector<bool>{true, true});  // equal points do not beat each other
  CHECK(front({{1, 30}, {1, 31}, {0.5, 31}}) == std::vector<bool>{false, false, true});
  CHECK(front({}).empty());
}

TEST_CASE("pareto: a lead within the margin is none") {
  const ParetoMargin margin{.time = 0.1, .psnr = 0.5};
  CHECK(front({{1, 40}, {0.95, 40}}, margin) == std::vector<bool>{true, true});
  CHECK(front({{1, 40}, {0.85, 40}}, margin) == std::vector<bool>{false, true});
  CHECK(front({{1, 40}, {1, 40.4}}, margin) == std::vector<bool>{true, true});
  CHECK(front({{1, 40}, {1, 40.6}}, margin) == std::vector<bool>{false, true});
  // Much faster and hardly worse also beats; so does hardly slower and much better.
  CHECK(front({{1, 40}, {0.5, 39.8}}, margin) == std::vector<bool>{false, true});
  CHECK(front({{1, 40}, {0.5, 39.4}}, margin) == std::vector<bool>{true, true});
  CHECK(front({{1, 40}, {1.05, 50}}, margin) == std::vector<bool>{false, true});
  CHECK(front({{1, 40}, {1.15, 50}}, margin) == std::vector<bool>{true, true});
}

TEST_CASE("pareto: what is smaller is beaten by nothing larger, what is no better and larger by all") {
  const ParetoMargin margin{.time = 0.1, .psnr = 0.5};
  CHECK(front({{1, 40, 10}, {0.5, 40, 80}}, margin) == std::vector<bool>{true, true});
  CHECK(front({{1, 40, 10}, {0.95, 40.4, 80}}, margin) == std::vector<bool>{true, false});
  CHECK(front({{1, 40, 10}, {0.5, 40, 10}}, margin) == std::vector<bool>{false, true});
}

TEST_CASE("pareto: numbers that are none lose, infinitely exact wins") {
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  CHECK(front({{nan, 50}, {1, nan}, {inf, 99}, {2, 20}, {3, inf}}) ==
        std::vector<bool>{false, false, false, true, true});
  CHECK_THROWS_WITH(front({}, {.time = -1, .psnr = 0}),
                    "[pareto_front] margins must be at least 0, that of times below 1, got -1 and 0");
  CHECK_THROWS_AS(front({}, {.time = 0, .psnr = nan}), ValueError);
}

TEST_CASE("pareto: any number of figures, and better in one of them is enough") {
  const auto of = [](std::vector<std::vector<double>> points) {
    return pareto_front(points, std::vector<double>{0.5, 0, 1});
  };
  //          the best of each figure, then one that the first beats in two, then one it beats by margins only
  CHECK(of({{9, 1, 1}, {1, 9, 1}, {1, 1, 9}, {9, 0, 0}, {8.6, 1, 0.1}}) ==
        std::vector<bool>{true, true, true, false, true});
  CHECK(of({{1, 1, std::nan("")}, {0, 0, 0}}) == std::vector<bool>{false, true});
  CHECK_THROWS_WITH(of({{1, 2}}), "[pareto_front] points must have a figure for each margin (3), got 2");
  CHECK_THROWS_WITH(pareto_front(std::vector<std::vector<double>>{}, std::vector<double>{-1}),
                    "[pareto_front] margins must be at least 0, got -1");
}
