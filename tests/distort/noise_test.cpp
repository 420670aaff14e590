#include <fieldmark/distort/noise.h>

#include "distort/support.h"
#include "support/expect_grad.h"

using namespace fieldmark;
using distort::noise;

TEST_CASE("noise: adds mu + sigma n") {
  const std::vector<double> n{1, -2, 0.5};
  const Tensor<double> x({1, 1, 3}, {0.2, 0.4, 0.9});
  const auto y = op_result<double>([&](auto&, auto v) { return noise(v[0], v[1], v[2], n); },
                                   {x, number<double>(0.25), number<double>(0.5)});
  CHECK(y.data == std::vector<double>{0.2 + 0.75, 0.4 - 0.75, 0.9 + 0.5});
  const auto plain =
      op_result<double>([&](auto&, auto v) { return noise(v[0], v[1], n); }, {x, number<double>(0)});
  CHECK(plain.data == x.data);
}

TEST_CASE("noise: gradient, sizes 0 and 1 too") {
  for (Shape s : {Shape{3, 2, 3}, Shape{1, 1, 1}, Shape{0, 4, 3}}) {
    const auto n = uniform(s, -2, 2, 5);
    expect_grad([&](auto&, auto v) { return noise(v[0], v[1], v[2], n.data); },
                {uniform(s, 0, 1, 1), number<double>(0.1), number<double>(0.3)});
  }
}

TEST_CASE("noise: errors") {
  Tape<float> tape;
  const Tensor<float> x({2, 1, 3}), bad({2}), minus({1}, -0.5f);
  const std::vector<float> n(6), few(5);
  const auto v = tape.constant(x);
  CHECK_THROWS_WITH(noise(v, tape.constant(minus), n),
                    "[noise] sigma: must be in 0 to 1e+06 (a standard deviation), got -0.5");
  CHECK_THROWS_WITH(noise(v, tape.constant(bad), n),
                    "[noise] sigma: axis 0 must be 1 (its layout is [1]), got shape [2]");
  const Tensor<float> one({1});
  CHECK_THROWS_WITH(noise(v, tape.constant(one), few),
                    "[noise] normal: must have one element for each of x, whose shape is [2, 1, 3], got 5");
}

TEST_CASE("noise: same bits for 1 and 2 threads") {
  const auto n = uniform<float>({90, 101, 3}, -2, 2, 5);
  const auto f = [&](auto&, auto v) { return noise(v[0], v[1], n.data); };
  const std::vector<Tensor<float>> in{uniform<float>({90, 101, 3}, 0, 1, 1), number<float>(0.1)};
  CHECK(run_with_grads<float>(f, in, 1) == run_with_grads<float>(f, in, 2));
}
