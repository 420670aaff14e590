#include <fieldmark/extractor/evidence_pool.h>

#include <cmath>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using extractor::cell_evidence;
using extractor::pooled_bits;

namespace {

// Computes row by row in double: softmax, then the sums as documented in the header.
struct Plain {
  std::vector<double> evidence, share;  // [cells]
  double foreground = 0;
};

template <class T>
Plain plain_sums(const Tensor<T>& sign, const Tensor<T>& index) {
  const Index columns = index.shape[1];
  const std::vector<double> none(static_cast<std::size_t>(columns - 1));
  Plain sums{none, none, 0};
  for (Index p = 0; p < sign.size(); ++p) {
    double z = 0;
    for (Index c = 0; c < columns; ++c) z += std::exp(static_cast<double>(index[p * columns + c]));
    const double expected = 2 / (1 + std::exp(-static_cast<double>(sign[p]))) - 1;
    for (Index c = 0; c + 1 < columns; ++c) {
      const double q = std::exp(static_cast<double>(index[p * columns + c])) / z;
      sums.evidence[static_cast<std::size_t>(c)] += q * expected;
      sums.share[static_cast<std::size_t>(c)] += q;
      sums.foreground += q;
    }
  }
  return sums;
}

template <class T>
std::vector<T> code_for(Index cells, Index bits) {
  std::vector<T> code(static_cast<std::size_t>(cells * bits));
  for (Index c = 0; c < cells; ++c)
    if (c % 7 != 6) code[static_cast<std::size_t>(c * bits + (c * 5) % bits)] = c % 3 == 0 ? T(-1) : T(1);
  return code;
}

template <class T>
void check_values(Index places, Index cells, Index bits, double tolerance) {
  CAPTURE(places, cells, bits);
  const auto sign = uniform<T>({places}, -4, 4, 1);
  const auto index = uniform<T>({places, cells + 1}, -5, 5, 2);
  const auto code = code_for<T>(cells, bits);
  const auto got =
      op_values<T>([&](auto&, auto v) { return pooled_bits(v[0], v[1], code, bits); }, {sign, index});
  const Plain sums = plain_sums(sign, index);
  REQUIRE(got.size() == static_cast<std::size_t>(bits));
  for (std::size_t b = 0; b < got.size(); ++b) {
    double want = 0;
    for (std::size_t c = 0; c < sums.evidence.size(); ++c)
      want += sums.evidence[c] * static_cast<double>(code[c * got.size() + b]);
    want /= sums.foreground / static_cast<double>(bits) + 1e-3;
    CHECK(std::abs(static_cast<double>(got[b]) - want) <= tolerance);
  }
}

}  // namespace

TEST_CASE("evidence_pool: pooled bits are what plain loops give") {
  for (Index places : {1, 9, 600})
    for (Index cells : {0, 1, 8, 37}) {
      check_values<double>(places, cells, 5, 1e-12);
      check_values<float>(places, cells, 5, 1e-5);
    }
  check_values<double>(12, 4, 1, 1e-13);
}

TEST_CASE("evidence_pool: certain places give the bits, an empty image gives 0") {
  // 4 places, 2 cells, 2 bits: places 0 and 1 show cell 0, places 2 and 3 show cell 1, both with the sign of
  // a 1.
  const std::vector<float> code{-1, 0, 0, 1};
  const Tensor<float> sign({4}, {-90, -90, 90, 90});
  Tensor<float> index({4, 3}, -200.f);
  for (Index p = 0; p < 4; ++p) index[p * 3 + p / 2] = 200;
  const auto pool = [&](auto&, auto v) { return pooled_bits(v[0], v[1], code, 2); };
  for (float bit : op_values<float>(pool, {sign, index})) CHECK(bit == Approx(1).epsilon(1e-3));
  Tensor<float> background({4, 3}, -200.f);
  for (Index p = 0; p < 4; ++p) background[p * 3 + 2] = 200;
  for (const auto& numbers : run_op<float>(pool, {sign, background}))
    for (float x : numbers) CHECK(x == 0);
  CHECK(op_values<float>(pool, {Tensor<float>({0}), Tensor<float>({0, 3})}) == std::vector<float>{0, 0});
}

TEST_CASE("evidence_pool: gradient in sign and index") {
  for (Index places : {0, 1, 5})
    for (Index cells : {1, 11}) {
      const auto code = code_for<double>(cells, 3);
      expect_grad([&](auto&, auto v) { return pooled_bits(v[0], v[1], code, 3); },
                  {uniform({places}, -2, 2, 1), uniform({places, cells + 1}, -2, 2, 2)});
    }
}

TEST_CASE("evidence_pool: float against double on every instruction set") {
  static const auto code = code_for<double>(30, 4);
  static const auto code_float = code_for<float>(30, 4);
  const auto pool = [](auto& tape, auto v) {
    if constexpr (std::is_same_v<std::decay_t<decltype(tape)>, Tape<double>>)
      return pooled_bits(v[0], v[1], code, 4);
    else
      return pooled_bits(v[0], v[1], code_float, 4);
  };
  CHECK(float_error(pool, {uniform<float>({700}, -6, 6, 1), uniform<float>({700, 31}, -9, 9, 2)}) < 1e-5);
}

TEST_CASE("evidence_pool: the gradient of either input alone") {
  const auto code = code_for<double>(3, 2);
  const auto sign = uniform({6}, -2, 2, 1), index = uniform({6, 4}, -2, 2, 2);
  expect_grad([&](auto& tape, auto v) { return pooled_bits(v[0], tape.constant(index), code, 2); }, {sign});
  expect_grad([&](auto& tape, auto v) { return pooled_bits(tape.constant(sign), v[0], code, 2); }, {index});
}

TEST_CASE("evidence_pool: evidence of cells is what plain loops give, and is added") {
  for (Index places : {0, 1, 700})
    for (Index cells : {0, 1, 23}) {
      const auto sign = uniform<float>({places}, -4, 4, 1);
      const auto index = uniform<float>({places, cells + 1}, -5, 5, 2);
      std::vector<double> evidence(static_cast<std::size_t>(cells), 2.0);
      cell_evidence(sign.data.data(), index.data.data(), places, cells, evidence.data());
      const Plain want = plain_sums(sign, index);
      for (std::size_t c = 0; c < evidence.size(); ++c)
        CHECK(evidence[c] ==
              Approx(2 + want.evidence[c] / std::pow(want.share[c] + 0.25, 0.3)).epsilon(1e-12));
    }
  // Logits that would overflow a plain exp.
  const float sign[] = {1000}, index[] = {1e30f, -1e30f, 0};
  double evidence[] = {0, 0};
  cell_evidence(sign, index, 1, 2, evidence);
  CHECK(evidence[0] == Approx(std::pow(1.25, -0.3)).epsilon(1e-14));
  CHECK(evidence[1] == 0);
}

TEST_CASE("evidence_pool: a cell of many places counts less than each of them alone, a sliver hardly") {
  // Cell 0 shows in 100 places, cell 1 in 4, cell 2 in almost none, all with the sign of a 1.
  const Index counts[] = {100, 4, 1};
  Tensor<float> sign({105}, 60.f), index({105, 4}, -200.f);
  for (Index p = 0, cell = 0, left = counts[0]; p < 105; ++p, --left) {
    if (left == 0) left = counts[++cell];
    index[p * 4 + cell] = 200;
  }
  index[104 * 4 + 3] = 204.6f;  // nearly background: e^-4.6, a hundredth of a place
  std::vector<double> evidence(3);
  cell_evidence(sign.data.data(), index.data.data(), 105, 3, evidence.data());
  CHECK(evidence[0] == Approx(25.1).epsilon(2e-3));
  CHECK(evidence[1] == Approx(2.59).epsilon(2e-3));
  CHECK(evidence[2] < 0.02);
  CHECK(evidence[2] > 0);
}

TEST_CASE("evidence_pool: the same bits on one and two threads") {
  const auto sign = uniform<float>({1500}, -4, 4, 1);
  const auto index = uniform<float>({1500, 61}, -5, 5, 2);
  const auto code = code_for<float>(60, 8);
  expect_same_bits([&](auto&, auto v) { return pooled_bits(v[0], v[1], code, 8); }, {sign, index});
  std::vector<double> one(60), two(60);
  const ScopedThreads serial(1);
  cell_evidence(sign.data.data(), index.data.data(), 1500, 60, one.data());
  const ScopedThreads parallel(2);
  cell_evidence(sign.data.data(), index.data.data(), 1500, 60, two.data());
  CHECK(one == two);
}

TEST_CASE("evidence_pool: errors") {
  Tape<float> tape;
  const Tensor<float> sign({3}), index({3, 4}), short_index({2, 4}), no_background({3, 0});
  const std::vector<float> code(6);
  const auto s = tape.constant(sign), x = tape.constant(index);
  CHECK_THROWS_WITH(pooled_bits(x, x, code, 2),
                    "[pooled_bits] sign must have rank 1 [places], got shape [3, 4]");
  CHECK_THROWS_WITH(pooled_bits(s, s, code, 2),
                    "[pooled_bits] index must have rank 2 [places, cells + 1], got shape [3]");
  CHECK_THROWS_WITH(pooled_bits(s, tape.constant(short_index), code, 2),
                    "[pooled_bits] index: axis 0 must be 3 (the places of sign), got shape [2, 4]");
  CHECK_THROWS_WITH(pooled_bits(s, tape.constant(no_background), code, 2),
                    "[pooled_bits] index must have a column for the background, got shape [3, 0]");
  CHECK_THROWS_WITH(pooled_bits(s, x, code, 0), "[pooled_bits] n_bits must be at least 1, got 0");
  CHECK_THROWS_WITH(pooled_bits(s, x, code, 3),
                    "[pooled_bits] code must have 9 numbers (cells x bits), got 6");
  CHECK_THROWS_WITH(cell_evidence(nullptr, nullptr, -1, 2, nullptr),
                    "[cell_evidence] places and cells must not be negative, got -1 and 2");
}
