#include <fieldmark/engine/tensor.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("tensor: an empty one has no elements, others are filled") {
  CHECK(Tensor<float>().size() == 0);
  CHECK(Tensor<float>().shape == Shape{0});
  const Tensor<double> t({2, 3}, 0.5);
  CHECK(t.size() == 6);
  CHECK(t.data == std::vector<double>(6, 0.5));
  CHECK(Tensor<float>({4}).data == std::vector<float>(4, 0.f));
  CHECK(Tensor<float>(Shape{}).size() == 1);
}

TEST_CASE("tensor: owns its numbers, row after row") {
  Tensor<int> a({2, 2}, {1, 2, 3, 4});
  const Tensor<int> b = a;
  a[2 * 1 + 0] = 7;
  CHECK(a.data == std::vector<int>{1, 2, 7, 4});
  CHECK(b[2] == 3);
}
