#include "simulated_jpeg.h"

#include <cmath>
#include <numbers>

#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

// Colour transform, cosine transform, mask and the way back, written out for one block.
std::vector<double> by_hand(const Tensor<double>& x, Index luma, Index chroma) {
  const double to[3][3] = {
      {0.299, 0.587, 0.114}, {-0.168735892, -0.331264108, 0.5}, {0.5, -0.418687589, -0.081312411}};
  // JFIF's inverse, to its six digits.
  const double from[3][3] = {{1, 0, 1.402}, {1, -0.344136, -0.714136}, {1, 1.772, 0}};
  const auto basis = [](Index u, Index i) {
    return (u == 0 ? std::sqrt(0.125) : 0.5) *
           std::cos((2 * static_cast<double>(i) + 1) * static_cast<double>(u) * std::numbers::pi / 16);
  };
  std::vector<double> ycc(192), y(192);
  for (Index c = 0; c < 3; ++c)
    for (Index u = 0; u < (c ? chroma : luma); ++u)
      for (Index v = 0; v < (c ? chroma : luma); ++v) {
        double sum = 0;
        for (Index i = 0; i < 8; ++i)
          for (Index j = 0; j < 8; ++j)
            for (Index k = 0; k < 3; ++k)
              sum += basis(u, i) * basis(v, j) * to[c][k] * x[(i * 8 + j) * 3 + k];
        for (Index i = 0; i < 8; ++i)
          for (Index j = 0; j < 8; ++j)
            ycc[static_cast<std::size_t>((i * 8 + j) * 3 + c)] += sum * basis(u, i) * basis(v, j);
      }
  for (std::size_t p = 0; p < 64; ++p)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) y[3 * p + c] += from[c][k] * ycc[3 * p + k];
  return y;
}

auto op(KeptFrequencies kept) {
  return [kept](auto&, auto v) { return simulated_jpeg(v[0], kept); };
}

}  // namespace

TEST_CASE("simulated_jpeg: the transform written out") {
  const auto x = uniform({1, 8, 8, 3}, -1, 1, 1);
  for (const KeptFrequencies kept : {KeptFrequencies{}, KeptFrequencies{8, 2}, KeptFrequencies{1, 0}}) {
    CAPTURE(kept.luma, kept.chroma);
    const auto y = op_values<double>(op(kept), {x});
    const auto expected = by_hand(x, kept.luma, kept.chroma);
    for (std::size_t i = 0; i < y.size(); ++i)
      CHECK(y[i] == Approx(expected[i]).margin(3e-6));  // the six digits of the inverse
  }
}

TEST_CASE("simulated_jpeg: blocks by themselves, all frequencies and flat images stay") {
  const auto x = uniform({2, 16, 24, 3}, -1, 1, 1);
  const auto all = op_values<double>(op({8, 8}), {x});
  for (std::size_t i = 0; i < all.size(); ++i) CHECK(all[i] == Approx(x.data[i]).margin(1e-12));
  const auto flat = op_values<double>(op({}), {Tensor<double>({1, 8, 8, 3}, 0.3)});
  for (const double v : flat) CHECK(v == Approx(0.3).margin(1e-12));
  Tensor<double> other = x;
  other[0] += 1;  // of the first block of the first image
  const auto before = op_values<double>(op({}), {x}), after = op_values<double>(op({}), {other});
  for (Index i = 0; i < x.size(); ++i) {
    const bool inside = i < 8 * 24 * 3 && i % (24 * 3) < 8 * 3;
    if (!inside) CHECK(before[static_cast<std::size_t>(i)] == after[static_cast<std::size_t>(i)]);
  }
  CHECK(before[0] != after[0]);
}

TEST_CASE("simulated_jpeg: threads and errors") {
  expect_same_bits(op({}), {uniform<float>({3, 40, 48, 3}, -1, 1, 1)});
  Tape<float> tape;
  const Tensor<float> odd({1, 8, 12, 3}), grey({1, 8, 8, 1}), fine({1, 8, 8, 3});
  CHECK_THROWS_WITH(
      simulated_jpeg(tape.constant(odd)),
      "[simulated_jpeg] x must have a height and a width of whole blocks of 8, got shape [1, 8, "
      "12, 3]");
  CHECK_THROWS_AS(simulated_jpeg(tape.constant(grey)), ShapeError);
  CHECK_THROWS_WITH(simulated_jpeg(tape.constant(fine), {9, 3}),
                    "[simulated_jpeg] kept.luma and kept.chroma must be 0 to 8, got 9 and 3");
}
