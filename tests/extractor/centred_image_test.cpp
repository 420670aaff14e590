#include <fieldmark/extractor/centred_image.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using extractor::centred_image;

TEST_CASE("centred_image: maps to -1 .. 1 and drops what does not fill a block") {
  const auto x = uniform<float>({2, 5, 7, 3}, 0, 1, 1);
  const auto y = op_values<float>([](auto&, auto v) { return centred_image(v[0], 3); }, {x});
  REQUIRE(y.size() == 2 * 3 * 6 * 3);
  std::size_t k = 0;
  for (Index n = 0; n < 2; ++n)
    for (Index i = 0; i < 3; ++i)
      for (Index j = 0; j < 6; ++j)
        for (Index c = 0; c < 3; ++c) CHECK(y[k++] == 2 * x[((n * 5 + i) * 7 + j) * 3 + c] - 1);
}

TEST_CASE("centred_image: gradient, sizes 0 and 1 included") {
  expect_grad([](auto&, auto v) { return centred_image(v[0], 2); }, {uniform({2, 3, 5, 3}, 0, 1, 1)});
  expect_grad([](auto&, auto v) { return centred_image(v[0]); }, {uniform({1, 1, 1, 1}, 0, 1, 1)});
  const auto none =
      run_op<double>([](auto&, auto v) { return centred_image(v[0], 2); }, {uniform({1, 1, 4, 3}, 0, 1, 1)});
  CHECK(none[0].empty());
  CHECK(none[1] == std::vector<double>(12, 0));
}

TEST_CASE("centred_image: errors and threads") {
  Tape<float> tape;
  const Tensor<float> flat({4, 4, 3}), x({1, 4, 4, 3});
  CHECK_THROWS_WITH(
      centred_image(tape.constant(flat)),
      "[centred_image] x must have rank 4 [images, height, width, channels], got shape [4, 4, 3]");
  CHECK_THROWS_WITH(centred_image(tape.constant(x), 0), "[centred_image] multiple must be at least 1, got 0");
  expect_same_bits([](auto&, auto v) { return centred_image(v[0], 2); },
                   {uniform<float>({2, 151, 33, 3}, 0, 1, 1)});
}
