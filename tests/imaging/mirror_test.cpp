#include <fieldmark/imaging/mirror.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("mirror: columns change places, channels do not, twice is nothing") {
  Tensor<float> x({2, 3, 2});
  for (Index i = 0; i < x.size(); ++i) x[i] = static_cast<float>(i);
  const Tensor<float> y = mirrored(x);
  CHECK(y.shape == x.shape);
  const std::vector<float> want{4, 5, 2, 3, 0, 1, 10, 11, 8, 9, 6, 7};
  CHECK(std::equal(want.begin(), want.end(), y.data.begin(), y.data.end()));
  CHECK(mirrored(y).data == x.data);
}
