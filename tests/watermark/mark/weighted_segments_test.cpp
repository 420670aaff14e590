#include <fieldmark/core/error.h>
#include <fieldmark/watermark/mark/weighted_segments.h>

#include "support/catch.h"
#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
const std::vector<std::int32_t> kBegin{0, 2, 2, 3, 6};
const std::vector<double> kWeights{0.5, -1, 2, 0, 0.25, 1};

// An op over segments whose weights have the tape's type.
template <class T>
auto over(const std::vector<std::int32_t>& begin, const std::vector<T>& weights) {
  return [&](auto&, auto v) { return weighted_segments<T>(v[0], begin, weights); };
}
}  // namespace

TEST_CASE("weighted_segments: sums by hand, 0 for an empty segment") {
  const Tensor<double> x({6, 2}, {1, 10, 2, 20, 3, 30, 4, 40, 5, 50, 6, 60});
  CHECK(op_values(over(kBegin, kWeights), std::vector{x}) ==
        std::vector<double>{-1.5, -15, 0, 0, 6, 60, 7.25, 72.5});
}

TEST_CASE("weighted_segments: gradient, also of nothing and of a single sample") {
  const auto check = [](const std::vector<std::int32_t>& begin, const std::vector<double>& w,
                        Index channels) {
    expect_grad([&](Tape<double>&, auto v) { return weighted_segments<double>(v[0], begin, w); },
                {uniform({static_cast<Index>(w.size()), channels}, -1, 1, 3)});
  };
  check(kBegin, kWeights, 3);
  check({0, 1}, {0.7}, 1);
  check({0, 0, 0}, {}, 2);
  check({0}, {}, 2);
}

TEST_CASE("weighted_segments: one and two threads give the same bits, float is near double") {
  const Index samples = 200000;
  std::vector<std::int32_t> begin{0};
  while (begin.back() < samples)
    begin.push_back(std::min<std::int32_t>(begin.back() + 1 + begin.back() % 7, samples));
  const std::vector<float> weights = uniform<float>({samples}, 0, 1, 4).data;
  const std::vector<double> exact(weights.begin(), weights.end());
  const std::vector inputs{uniform<float>({samples, 3}, -1, 1, 5)};
  expect_same_bits(over(begin, weights), inputs);
  const auto either = [&](auto&, auto v) {
    if constexpr (std::is_same_v<std::decay_t<decltype(*v[0].value())>, float>)
      return weighted_segments<float>(v[0], begin, weights);
    else
      return weighted_segments<double>(v[0], begin, exact);
  };
  CHECK(float_error(either, inputs) < 1e-6);
}

TEST_CASE("weighted_segments: errors name what does not fit") {
  Tape<double> tape;
  const Tensor<double> values({6, 2}), flat(Shape{6});
  const Var<double> x = tape.constant(values);
  const auto run = [&](const std::vector<std::int32_t>& begin, std::size_t weights) {
    return weighted_segments<double>(x, begin, std::span(kWeights).first(weights));
  };
  CHECK_THROWS_AS(weighted_segments<double>(tape.constant(flat), kBegin, kWeights), ShapeError);
  CHECK_THROWS_WITH(weighted_segments<double>(tape.constant(flat), kBegin, kWeights),
                    "[weighted_segments] x must have rank 2 [S, C], got shape [6]");
  CHECK_THROWS_AS(run(kBegin, 5), ShapeError);
  CHECK_THROWS_WITH(run(kBegin, 5), "[weighted_segments] weights must have one number a row of x (6), got 5");
  for (const auto& bad : std::vector<std::vector<std::int32_t>>{{}, {1, 6}, {0, 5}, {0, 4, 3, 6}}) {
    CHECK_THROWS_AS(run(bad, 6), ValueError);
    CHECK_THROWS_WITH(run(bad, 6), "[weighted_segments] begin must rise from 0 to the rows of x, 6");
  }
}

TEST_CASE("weighted_segments: takes vectors, with the type of the Var") {
  const Tensor<double> x({6, 1}, {1, 2, 3, 4, 5, 6});
  CHECK(op_values([](auto&, auto v) { return weighted_segments(v[0], kBegin, kWeights); }, std::vector{x}) ==
        std::vector<double>{-1.5, 0, 6, 7.25});
}
