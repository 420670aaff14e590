#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/values.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("values: copies outlive the pass") {
  Tape<double> tape;
  const Tensor<double> x({2, 2}, {1, 2, 3, 4});
  Tensor<double> g({2, 2});
  const auto v = tape.reshape(tape.leaf(x, g), {4}), y = sum(v);
  CHECK(grad_to_tensor(v).data == std::vector<double>{0, 0, 0, 0});
  tape.backward(y);
  CHECK(item(y) == 10);
  const auto copy = to_tensor(v), grad = grad_to_tensor(v);
  tape.reset();
  CHECK((copy.shape == Shape{4} && copy.data == x.data));
  CHECK(grad.data == std::vector<double>{1, 1, 1, 1});
}

TEST_CASE("values: errors") {
  Tape<double> tape;
  const Tensor<double> x({2, 2});
  CHECK_THROWS_WITH(item(tape.constant(x)), "[item] v must have one element, got shape [2, 2]");
}
