#include <fieldmark/engine/dual/layout.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/values.h>

#include <array>

#include "support/dual_op.h"

using namespace fieldmark;

namespace {

constexpr std::array<std::int32_t, 4> kLayoutIndex{1, 0, 1, 1};

// Checks a linear op: its tangent is the op of the tangent, and its products in float match those in double.
template <class F>
void expect_linear(const F& f, Shape shape) {
  const auto x = uniform(shape, -1, 1, 1), v = uniform(shape, -1, 1, 2);
  const auto apply = [&](auto&, auto q) { return f(q[0]); };
  const auto r = jvp(apply, {x}, {v});
  CHECK(r.product.shape == r.value.shape);
  Tape<double> tape;
  CHECK(r.value.data == to_tensor(f(tape.constant(x))).data);
  CHECK(r.product.data == to_tensor(f(tape.constant(v))).data);
  CHECK(float_products_error(apply, {uniform<float>(shape, -1, 1, 1)}) < 1e-6);
}

}  // namespace

TEST_CASE("dual/layout: ops that move elements move tangents") {
  expect_linear([](auto x) { return reshape(x, {4, 6}); }, {2, 3, 4});
  expect_linear([](auto x) { return permute(x, {2, 0, 1}); }, {2, 3, 4});
  expect_linear([](auto x) { return transpose(x); }, {2, 3, 4});
  expect_linear([](auto x) { return transpose(x, 0, 1); }, {2, 3, 4});
  expect_linear([](auto x) { return broadcast_to(x, {4, 2, 3}); }, {2, 1});
  expect_linear([](auto x) { return pad(x, 1, 2, 1); }, {2, 3, 4});
  expect_linear([](auto x) { return cumsum(x); }, {2, 3, 4});
  expect_linear([](auto x) { return slice(x, 1, 2); }, {2, 3, 4});
  expect_linear([](auto x) { return slice(x, 0, 1, 1); }, {2, 3, 4});
  expect_linear([](auto x) { return concatenate({x, x}); }, {2, 3});
  expect_linear([](auto x) { return concatenate({x, x}, 0); }, {2, 3});
  expect_linear([](auto x) { return gather(x, 1, kLayoutIndex); }, {3, 2, 2});
  expect_linear([](auto x) { return scatter_add(x, 1, kLayoutIndex, 3); }, {3, 4, 2});
  expect_linear([](auto x) { return broadcast_rows(x, 3); }, {1, 4});
  expect_linear([](auto x) { return gather_rows(x, kLayoutIndex); }, {2, 3});
}

TEST_CASE("dual/layout: ops of images") {
  expect_linear([](auto x) { return avg_pool(x, 2); }, {2, 4, 5, 3});
  expect_linear([](auto x) { return global_avg_pool(x); }, {2, 4, 5, 3});
  expect_linear([](auto x) { return upsample_nearest(x, 2); }, {2, 2, 3, 2});
  expect_linear([](auto x) { return upsample_to(x, 5, 4); }, {2, 2, 3, 2});
  expect_linear([](auto x) { return upsample_to(x, 5, 4, Interpolation::nearest); }, {2, 2, 3, 2});
  expect_linear([](auto x) { return space_to_depth(x); }, {2, 2, 4, 3});
}

TEST_CASE("dual/layout: what pad() adds is constant, and what concatenate() joins may be") {
  const Tensor<double> x({2}, {1, 2}), v({2}, {3, 4});
  CHECK(jvp([](auto&, auto q) { return pad(q[0], 0, 1, 1, 9); }, {x}, {v}).product.data ==
        std::vector<double>{0, 3, 4, 0});
  Tape<double> tape;
  const Dual<double> dual(tape.constant(x), tape.constant(v)), constant(tape.constant(x));
  CHECK(to_tensor(concatenate({constant, dual}).tangent()).data == std::vector<double>{0, 0, 3, 4});
  CHECK(to_tensor(concatenate({dual, constant}, 0).tangent()).data == std::vector<double>{3, 4, 0, 0});
  CHECK_FALSE(concatenate({constant, constant}).has_tangent());
  const std::vector<Dual<double>> both{constant, dual};
  CHECK(to_tensor(concatenate(both).tangent()).data == std::vector<double>{0, 0, 3, 4});
  CHECK(to_tensor(concatenate(both, 0).tangent()).data == std::vector<double>{0, 0, 3, 4});
}

TEST_CASE("dual/layout: detach() stops tangent and gradient") {
  // d/dx of x detach(x) differentiates the first factor only.
  const auto f = [](auto&, auto q) { return mul(q[0], detach(q[0])); };
  const auto d = derivatives(f, 3);
  CHECK(d.value == 9);
  CHECK(d.first == 3);
  CHECK(d.second == 0);
}
