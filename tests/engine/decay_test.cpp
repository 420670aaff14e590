#include <fieldmark/engine/decay.h>

#include <cmath>
#include <limits>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("decay: values") {
  CHECK(cosine_decay(0, 100) == 1);
  CHECK(cosine_decay(50, 100) == Approx(0.5).epsilon(1e-15));
  CHECK(cosine_decay(25, 100, 0.2) == Approx(0.2 + 0.4 * (1 + std::sqrt(0.5))).epsilon(1e-15));
  CHECK(cosine_decay(100, 100, 0.2) == Approx(0.2).epsilon(1e-15));
  CHECK(cosine_decay(1000, 100, 0.2) == cosine_decay(100, 100, 0.2));
  CHECK(step_decay(29, 30) == 1);
  CHECK(step_decay(60, 30, 0.5) == 0.25);
  CHECK(exponential_decay(3, 0.5) == 0.125);
  CHECK(warm_up(0, 4) == 0.25);
  CHECK(warm_up(3, 4) == 1);
  CHECK(warm_up(9, 4) == 1);
  CHECK(warm_up(0, 0) == 1);
}

TEST_CASE("decay: errors") {
  CHECK_THROWS_WITH(cosine_decay(-1, 10), "[cosine_decay] n must be at least 0, got -1");
  CHECK_THROWS_WITH(cosine_decay(0, 0), "[cosine_decay] steps must be positive, got 0");
  CHECK_THROWS_WITH(cosine_decay(0, 1, 2), "[cosine_decay] last must be in [0, 1], got 2");
  CHECK_THROWS_WITH(step_decay(0, 0), "[step_decay] every must be positive, got 0");
  CHECK_THROWS_WITH(step_decay(0, 1, 0), "[step_decay] factor must be in (0, 1], got 0");
  CHECK_THROWS_WITH(step_decay(std::numeric_limits<Index>::min(), 1),
                    "[step_decay] n must be at least 0, got -9223372036854775808");
  CHECK_THROWS_WITH(exponential_decay(0, 1.5), "[exponential_decay] factor must be in (0, 1], got 1.5");
  CHECK_THROWS_AS(exponential_decay(0, std::nan("")), ValueError);
  CHECK_THROWS_WITH(warm_up(0, -1), "[warm_up] steps must be at least 0, got -1");
}
