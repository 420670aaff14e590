#include <fieldmark/engine/ops/rows.h>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;

static const std::vector<std::int32_t> kIndex{3, 0, 3, 1, 3};
static const auto f_broadcast = [](auto&, auto v) { return broadcast_rows(v[0], 3); };
static const auto f_gather = [](auto&, auto v) { return gather_rows(v[0], kIndex); };

TEST_CASE("rows: values") {
  CHECK(op_values(f_broadcast, std::vector<Tensor<double>>{{{1, 2}, {4, 5}}}) ==
        std::vector<double>{4, 5, 4, 5, 4, 5});
  CHECK(op_values(f_gather, std::vector<Tensor<double>>{{{4, 2}, {0, 1, 10, 11, 20, 21, 30, 31}}}) ==
        std::vector<double>{30, 31, 0, 1, 30, 31, 10, 11, 30, 31});
}

TEST_CASE("rows: gradient") {
  for (Index n : {0, 1, 5}) {
    CAPTURE(n);
    const auto f = [n](Tape<double>&, std::span<const Var<double>> v) { return broadcast_rows(v[0], n); };
    expect_grad(f, {uniform({1, 3}, -1, 1, 1)});
    expect_grad(f, {uniform({2}, -1, 1, 1)});
    expect_grad(f_gather, {uniform({4, n}, -1, 1, 1)});
  }
  const auto none = [](Tape<double>&, std::span<const Var<double>> v) { return gather_rows(v[0], {}); };
  expect_grad(none, {uniform({4, 3}, -1, 1, 1)});
  expect_grad(none, {uniform({0, 3}, -1, 1, 1)});
}

TEST_CASE("rows: gathered gradients against a plain loop") {
  std::vector<std::int32_t> index(500);
  for (std::size_t i = 0; i < index.size(); ++i) index[i] = static_cast<std::int32_t>(i * i % 41);
  const auto got = run_op([&](auto&, auto v) { return gather_rows(v[0], index); },
                          std::vector{uniform<double>({41, 3}, -1, 1, 1)});
  const auto u = uniform<double>({500, 3}, -1, 1, 99);
  std::vector<double> want(41 * 3);
  for (std::size_t i = 0; i < 500; ++i)
    for (std::size_t c = 0; c < 3; ++c) want[static_cast<std::size_t>(index[i]) * 3 + c] += u.data[i * 3 + c];
  CHECK(got[1] == want);
}

TEST_CASE("rows: errors") {
  Tape<double> tape;
  const Tensor<double> two({2, 3}), row({1, 3});
  CHECK_THROWS_WITH(broadcast_rows(tape.constant(two), 3),
                    "[broadcast_rows] x must be one row, [1, C] or [C], got shape [2, 3]");
  CHECK_THROWS_WITH(broadcast_rows(tape.constant(row), -1), Contains("0 or more, got -1"));
  CHECK_THROWS_WITH(gather_rows(tape.constant(two), kIndex),
                    "[gather_rows] index: entry 0 must be in [0, 2) (the rows of x), got 3");
}

TEST_CASE("rows: same bits for any thread count") {
  std::vector<std::int32_t> index(30000);
  for (std::size_t i = 0; i < index.size(); ++i) index[i] = static_cast<std::int32_t>((i * 7919) % 20000);
  expect_same_bits([&](auto&, auto v) { return gather_rows(v[0], index); },
                   {uniform<float>({20000, 5}, -1, 1, 1)});
  expect_same_bits([](auto&, auto v) { return broadcast_rows(v[0], 50000); },
                   {uniform<float>({1, 5}, -1, 1, 1)});
}

TEST_CASE("rows: an index may change or be gone when the backward runs") {
  const std::vector<Tensor<double>> in{uniform({4, 2}, -1, 1, 1)};
  const auto gone = [](auto&, auto v) {
    std::vector<std::int32_t> index = kIndex;
    const auto y = gather_rows(v[0], index);
    std::ranges::fill(index, 1 << 30);
    return y;
  };
  CHECK(run_op(gone, in) == run_op(f_gather, in));
}
