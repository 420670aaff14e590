#include <fieldmark/engine/ops/gather.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {
const std::vector<std::int32_t> kPicked{2, 0, 2};
const auto f_gather_axis = [](auto&, auto v) { return gather(v[0], 1, kPicked); };
const auto f_scatter = [](auto&, auto v) { return scatter_add(v[0], -1, kPicked, 4); };
}  // namespace

TEST_CASE("gather: values") {
  const std::vector<Tensor<double>> in{{{2, 3}, {1, 2, 3, 4, 5, 6}}};
  CHECK(op_values(f_gather_axis, in) == std::vector<double>{3, 1, 3, 6, 4, 6});
  CHECK(op_values(f_scatter, in) == std::vector<double>{2, 0, 4, 0, 5, 0, 10, 0});
  const std::vector<std::int32_t> rows{1, 1};
  CHECK(op_values([&](auto&, auto v) { return gather(v[0], 0, rows); }, in) ==
        std::vector<double>{4, 5, 6, 4, 5, 6});
  CHECK(op_values([&](auto&, auto v) { return scatter_add(v[0], 0, rows, 2); }, in) ==
        std::vector<double>{0, 0, 0, 5, 7, 9});
}

TEST_CASE("gather: gradient") {
  for (Shape s : {Shape{0, 3}, Shape{1, 3}, Shape{2, 3, 2}, Shape{2, 3, 0}})
    expect_grad(f_gather_axis, {uniform(s, -1, 1, 1)});
  for (Shape s : {Shape{3}, Shape{0, 3}, Shape{2, 2, 3}}) expect_grad(f_scatter, {uniform(s, -1, 1, 1)});
}

TEST_CASE("gather: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3});
  const auto x = tape.constant(a);
  const std::vector<std::int32_t> far{0, 3}, below{-1, 0, 0};
  CHECK_THROWS_WITH(gather(x, 2, kPicked),
                    "[gather] axis must be in [-2, 1], an axis of shape [2, 3], got 2");
  CHECK_THROWS_WITH(gather(x, -1, far), "[gather] index: entry 1 must be in [0, 3) (axis 1 of x), got 3");
  CHECK_THROWS_WITH(scatter_add(x, 1, far, 5),
                    "[scatter_add] index must have one element for each of axis 1 "
                    "of x, whose shape is [2, 3], got 2");
  CHECK_THROWS_WITH(scatter_add(x, 1, below, 5),
                    "[scatter_add] index: entry 0 must be in [0, 5) (axis 1 of y), got -1");
  CHECK_THROWS_WITH(scatter_add(x, 1, kPicked, -2), "[scatter_add] extent must be 0 or more, got -2");
  CHECK_THROWS_AS(scatter_add(x, 3, kPicked, 2), ShapeError);
}

TEST_CASE("gather: same bits for any thread count") {
  std::vector<std::int32_t> index;
  for (int i = 0; i < 5000; ++i) index.push_back(i * i % 37);
  const auto x = uniform<float>({40, 37, 3}, -1, 1, 1), y = uniform<float>({5000, 37}, -1, 1, 2);
  expect_same_bits([&](auto&, auto v) { return gather(v[0], 1, index); }, {x});
  expect_same_bits([&](auto&, auto v) { return scatter_add(v[0], 0, index, 37); }, {y});
}

TEST_CASE("gather: an index may change or be gone when the backward runs") {
  const auto gone = [](auto op) {
    return [=](auto&, auto v) {
      std::vector<std::int32_t> index = kPicked;
      const auto y = op(v[0], index);
      std::ranges::fill(index, 1 << 30);
      return y;
    };
  };
  const std::vector<Tensor<double>> in{uniform({2, 3}, -1, 1, 1)};
  CHECK(run_op(gone([](auto x, const auto& i) { return gather(x, 1, i); }), in) == run_op(f_gather_axis, in));
  CHECK(run_op(gone([](auto x, const auto& i) { return scatter_add(x, -1, i, 4); }), in) ==
        run_op(f_scatter, in));
}
