#include "doubling_conv.h"
#include <fieldmark/engine/ops/resample.h>

#include <algorithm>

#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("doubling_conv: depth_to_space is the inverse of space_to_depth") {
  const auto x = uniform({2, 6, 4, 3}, -1, 1, 1);
  const auto y = op_values<double>([](auto&, auto v) { return depth_to_space(space_to_depth(v[0])); }, {x});
  CHECK(y == x.data);
}

// A transposed convolution: adds each pixel times the window at the window's position.
TEST_CASE("doubling_conv: windows laid beside one another, then normalised") {
  ParamStore<double> store;
  const DoublingConv<double> layer(store, "d", 2, 1);
  const auto x = uniform({1, 3, 2, 2}, -1, 1, 1);
  const auto w = store.values(store.find("d/spread/weight"));  // [2, 4 x 2]
  Tensor<double> laid({6, 4, 2});
  for (Index i = 0; i < 3; ++i)
    for (Index j = 0; j < 2; ++j)
      for (Index a = 0; a < 2; ++a)
        for (Index b = 0; b < 2; ++b)
          for (Index o = 0; o < 2; ++o)
            for (Index c = 0; c < 2; ++c)
              laid[((2 * i + a) * 4 + 2 * j + b) * 2 + o] +=
                  x[(i * 2 + j) * 2 + c] * w[static_cast<std::size_t>(c * 8 + (2 * a + b) * 2 + o)];
  // Running statistics of mean 0 and variance 1 leave the sums unchanged, except for eps.
  const auto y = op_values<double>(
      [&](auto&, auto v) {
        NormPass<double> pass{.running = true};
        return layer(Params<double>(store, nullptr), v[0], pass);
      },
      {x});
  REQUIRE(y.size() == 48);
  for (Index k = 0; k < 48; ++k)
    CHECK(y[static_cast<std::size_t>(k)] == Approx(std::max(laid[k], 0.0)).margin(1e-4));  // eps 1e-5
}

TEST_CASE("doubling_conv: threads and errors") {
  expect_same_bits([](auto&, auto v) { return depth_to_space(v[0]); },
                   {uniform<float>({2, 30, 31, 12}, -1, 1, 1)});
  Tape<float> tape;
  const Tensor<float> x({1, 2, 2, 6});
  CHECK_THROWS_WITH(
      depth_to_space(tape.constant(x)),
      "[depth_to_space] x must have a number of channels that is a multiple of 4, got shape [1, "
      "2, 2, 6]");
}
