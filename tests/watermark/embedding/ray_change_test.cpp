#include "ray_change.h"

#include <vector>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("ray_change: each ray shows the weighted sum over its samples, a ray without samples nothing") {
  const std::vector<std::int32_t> begin{0, 2, 2, 3};
  const std::vector<float> weight{0.5f, 0.25f, 1}, a{1, 2, 3, 4, 5, 6, 7, 8, 9},
      b{0, 2, 1, 0, 1, 6, 7, 6, 12};
  std::vector<float> change(9, -1);
  change_on_rays(begin, weight, a.data(), b.data(), change.data());
  CHECK(change == std::vector<float>{1.5f, 1, 1, 0, 0, 0, 0, 2, -3});
  CHECK(power_on_rays(begin, weight, a.data(), b.data()) == 1.5 * 1.5 + 1 + 1 + 4 + 9);
}
