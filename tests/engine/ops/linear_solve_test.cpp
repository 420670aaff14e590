#include <fieldmark/engine/ops/batched_matmul.h>
#include <fieldmark/engine/ops/linear_solve.h>

#include "support/expect_grad.h"
#include "support/matrices.h"
#include "support/run_op.h"

using namespace fieldmark;

static const auto f_solve = [](auto&, auto v) { return solve(v[0], v[1]); };
static const auto f_inverse = [](auto&, auto v) { return inverse(v[0]); };
static const auto f_lower = [](auto&, auto v) { return triangular_solve(v[0], v[1]); };

TEST_CASE("linear_solve: the product with what was solved is the right side") {
  const auto a = regular({3, 6, 6}, 1), b = uniform({3, 6, 2}, -1, 1, 2);
  Tape<double> tape;
  const auto va = tape.constant(a), vb = tape.constant(b);
  const auto check = [&](Var<double> left, Var<double> x) {
    const auto y = batched_matmul(left, x);
    for (Index i = 0; i < b.size(); ++i) CHECK(y.value()[i] == Approx(b[i]).margin(1e-14));
  };
  check(va, solve(va, vb));
  check(va, batched_matmul(inverse(va), vb));
  for (const bool upper : {false, true})
    for (const bool transposed : {false, true}) {
      Tensor<double> t(a.shape);
      for (Index i = 0; i < 3; ++i)
        for (Index r = 0; r < 6; ++r)
          for (Index c = 0; c < 6; ++c)
            if (upper ? c >= r : c <= r)
              t[transposed ? (i * 6 + c) * 6 + r : (i * 6 + r) * 6 + c] = a[(i * 6 + r) * 6 + c];
      check(tape.constant(t.data.data(), t.shape),
            triangular_solve(va, vb, {.upper = upper, .transposed = transposed}));
    }
}

TEST_CASE("linear_solve: matrices that are decomposed in blocks, with rows to swap") {
  constexpr Index n = 100;
  const auto a = uniform({2, n, n}, -1, 1, 1), b = uniform({2, n, 3}, -1, 1, 2);  // no large diagonal
  Tape<double> tape;
  const auto va = tape.constant(a), vb = tape.constant(b);
  for (const Var<double> x : {solve(va, vb), batched_matmul(inverse(va), vb)}) {
    const auto y = batched_matmul(va, x);
    for (Index i = 0; i < b.size(); ++i) CHECK(y.value()[i] == Approx(b[i]).margin(1e-9));
  }
}

TEST_CASE("linear_solve: gradient") {
  for (Shape s : {Shape{0, 0}, Shape{1, 1}, Shape{2, 3, 3}}) {
    const auto a = regular(s, 1);
    const Shape right = s.rank() == 3 ? Shape{2, 3, 2} : Shape{s[0], 2};
    expect_grad(f_inverse, {a});
    expect_grad(f_solve, {a, uniform(right, -1, 1, 2)});
    for (const bool upper : {false, true})
      for (const bool transposed : {false, true})
        expect_grad(
            [=](auto&, auto v) {
              return triangular_solve(v[0], v[1], {.upper = upper, .transposed = transposed});
            },
            {a, uniform(right, -1, 1, 2)});
  }
  expect_grad([](auto&, auto v) { return solve(v[0], v[0]); }, {regular({2, 2}, 3)});
  expect_grad([](auto&, auto v) { return triangular_solve(v[0], v[0]); }, {regular({2, 2}, 3)});
}

TEST_CASE("linear_solve: errors") {
  Tape<double> tape;
  const Tensor<double> a({2, 3}), b({3, 2}), singular({2, 2, 2}, {1, 0, 0, 1, 1, 2, 2, 4}),
      right({2, 2, 1}, 1.0), nan({2, 2}, std::nan(""));
  const auto s = tape.constant(singular), r = tape.constant(right);
  CHECK_THROWS_WITH(inverse(tape.constant(a)),
                    "[inverse] a must be square matrices [.., n, n], got shape [2, 3]");
  CHECK_THROWS_WITH(
      solve(s, tape.constant(b)),
      "[solve] b must be [.., n, k] with the axes of a but for its last, [2, 2, 2], got shape [3, 2]");
  CHECK_THROWS_WITH(inverse(s),
                    "[inverse] a: matrix 1 must not be singular, got the reciprocal condition number 0");
  CHECK_THROWS_WITH(solve(s, r), Contains("[solve] a: matrix 1 must not be singular"));
  CHECK_THROWS_WITH(inverse(tape.constant(nan)),
                    "[inverse] a: matrix 0 must be finite, got a NaN or an infinity");
  const Tensor<double> no_diagonal({2, 2, 2}, {1, 0, 0, 1, 1, 2, 2, 0});
  CHECK_THROWS_WITH(triangular_solve(tape.constant(no_diagonal), r),
                    "[triangular_solve] a: matrix 1 must not be singular, got 0 on the diagonal in row 1");
  // A pivot of exactly 0 in the last row, which a condition estimate can miss.
  const Tensor<double> no_pivot({2, 2}, {1, 0, 0, 0});
  CHECK_THROWS_WITH(inverse(tape.constant(no_pivot)),
                    "[inverse] a: matrix 0 must not be singular, got the reciprocal condition number 0");
  // A matrix that is singular in float but not in double.
  const Tensor<double> close({2, 2}, {1, 1, 1, 1 + 1e-9});
  const Tensor<float> rounded({2, 2}, {1, 1, 1, 1 + 6e-8f});
  Tape<float> single;
  CHECK_NOTHROW(inverse(tape.constant(close)));
  CHECK_THROWS_AS(inverse(single.constant(rounded)), ValueError);
}

TEST_CASE("linear_solve: the first of several singular matrices is named for any thread count") {
  expect_first_bad_named([](auto a) { return inverse(a); }, "inverse");
  expect_first_bad_named([](auto a) { return solve(a, a); }, "solve");
  expect_first_bad_named([](auto a) { return triangular_solve(a, a); }, "triangular_solve");
}

TEST_CASE("linear_solve: same bits for any thread count") {
  const auto a = regular<float>({9, 40, 40}, 1), b = uniform<float>({9, 40, 3}, -1, 1, 2);
  expect_same_bits(f_solve, {a, b});
  expect_same_bits(f_lower, {a, b});
  expect_same_bits(f_inverse, {a});
  expect_same_bits(f_inverse, {regular<float>({150, 150}, 1)});
}
