#include <fieldmark/distort/quantize8.h>

#include "distort/support.h"
#include "support/catch.h"

using namespace fieldmark;
using distort::quantize8;

TEST_CASE("quantize8: clamps and rounds as llround does") {
  auto x = uniform<double>({1000}, -0.5, 1.5, 1);
  x[0] = 0.5 / 255;
  x[1] = 1;
  x[2] = HUGE_VAL;
  x[3] = -HUGE_VAL;
  const auto y = op_result<double>([](auto&, auto v) { return quantize8(v[0]); }, {x});
  for (Index i = 0; i < x.size(); ++i)
    CHECK(y[i] == static_cast<double>(std::llround(std::clamp(x[i], 0.0, 1.0) * 255)) / 255);
  const auto again = op_result<double>([](auto&, auto v) { return quantize8(v[0]); }, {y});
  CHECK(again.data == y.data);
}

TEST_CASE("quantize8: straight-through inside the range and nothing outside") {
  const Tensor<float> x({5}, {-0.1f, 0.f, 0.3f, 1.f, 1.1f});
  Tensor<float> dx({5}, 0.5f);
  Tape<float> tape;
  tape.backward(quantize8(tape.leaf(x, dx)), std::vector<float>{1, 2, 3, 4, 5});
  CHECK(dx.data == std::vector<float>{0.5f, 2.5f, 3.5f, 4.5f, 0.5f});
}

TEST_CASE("quantize8: same bits for 1 and 2 threads, empty too") {
  for (Index n : {0, 40000}) {
    const auto f = [](auto&, auto v) { return quantize8(v[0]); };
    const std::vector<Tensor<float>> in{uniform<float>({n}, -0.2, 1.2, 1)};
    CHECK(run_with_grads<float>(f, in, 1) == run_with_grads<float>(f, in, 2));
  }
}
