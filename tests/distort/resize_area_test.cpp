#include <fieldmark/distort/resize_area.h>

#include "distort/support.h"
#include "support/each_isa.h"
#include "support/expect_grad.h"

using namespace fieldmark;
using distort::resize_area;
using distort::resize_labels;

namespace {
// Cuts every pixel into (height x width) equal squares, so that every new pixel is the mean of whole squares.
Tensor<double> brute_force(const Tensor<double>& x, Index height, Index width) {
  const Index h = x.shape[0], w = x.shape[1], channels = x.shape[2];
  Tensor<double> y({height, width, channels});
  for (Index r = 0; r < h * height; ++r)
    for (Index q = 0; q < w * width; ++q)
      for (Index c = 0; c < channels; ++c)
        y[((r / h) * width + q / w) * channels + c] +=
            x[((r / height) * w + q / width) * channels + c] / static_cast<double>(h * w);
  return y;
}
}  // namespace

TEST_CASE("resize_area: equals the mean over each new pixel's area, any ratio, within 1e-14") {
  const auto x = uniform({7, 10, 3}, 0, 1, 1);
  for (Index height : {1, 3, 5, 7, 9, 14})
    for (Index width : {1, 4, 5, 10, 13}) {
      const auto y = op_result<double>([&](auto&, auto v) { return resize_area(v[0], height, width); }, {x});
      CHECK(largest_difference(y, brute_force(x, height, width)) < 1e-14);
    }
}

TEST_CASE("resize_area: the same size is the exact identity, a constant stays constant") {
  for (Shape s : {Shape{1, 1, 3}, Shape{5, 8, 3}}) {
    const auto x = uniform<float>(s, 0, 1, 1);
    CHECK(op_result<float>([&](auto&, auto v) { return resize_area(v[0], s[0], s[1]); }, {x}).data == x.data);
  }
  const auto y = op_result<float>([](auto&, auto v) { return resize_area(v[0], 75, 31); },
                                  {Tensor<float>({100, 90, 3}, 0.3f)});
  for (float v : y.data) CHECK(std::abs(v - 0.3f) < 1e-7f);
}

TEST_CASE("resize_area: gradient") {
  expect_grad([](auto&, auto v) { return resize_area(v[0], 3, 4); }, {uniform({5, 7, 3}, 0, 1, 1)});
  expect_grad([](auto&, auto v) { return resize_area(v[0], 4, 5); }, {uniform({2, 3, 1}, 0, 1, 1)});
  expect_grad([](auto&, auto v) { return resize_area(v[0], 1, 1); }, {uniform({1, 1, 1}, 0, 1, 1)});
  expect_grad([](auto&, auto v) { return resize_area(v[0], 2, 1); }, {Tensor<double>({3, 2, 0})});
}

TEST_CASE("resize_area: labels under the new pixels' centres") {
  const Tensor<std::int32_t> labels({2, 4}, {1, 2, 3, 4, 5, 6, 7, 8});
  CHECK(resize_labels(labels, 2, 4).data == labels.data);
  CHECK(resize_labels(labels, 1, 4).data == std::vector<std::int32_t>{5, 6, 7, 8});
  CHECK(resize_labels(labels, 2, 3).data == std::vector<std::int32_t>{1, 3, 4, 5, 7, 8});
  CHECK(resize_labels(labels, 2, 8).data ==
        std::vector<std::int32_t>{1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8});
}

TEST_CASE("resize_area: float against double, result and gradient, for widths of 1 to 130") {
  each_isa([] {
    for (Index w = 1; w <= 130; ++w) {
      CAPTURE(w);
      const auto x = uniform<float>({5, w, 1 + w % 3}, 0, 1, 1);
      CHECK(distortion_error([](auto&, auto v) { return resize_area(v[0], 3, 17); }, {x}) < 1e-6);
    }
  });
}

TEST_CASE("resize_area: errors") {
  Tape<float> tape;
  const Tensor<float> x({2, 2, 3}), none({0, 2, 3});
  CHECK_THROWS_WITH(resize_area(tape.constant(x), 0, 2),
                    "[resize_area] height and width: must be at least 1, got 0 and 2");
  CHECK_THROWS_WITH(resize_area(tape.constant(none), 1, 1),
                    "[resize_area] x: must have at least one pixel, got shape [0, 2, 3]");
  CHECK_THROWS_WITH(resize_labels(Tensor<std::int32_t>({2}), 1, 1),
                    "[resize_labels] labels must have rank 2 [height, width], got shape [2]");
}

TEST_CASE("resize_area: same bits for 1 and 2 threads") {
  const auto f = [](auto&, auto v) { return resize_area(v[0], 91, 75); };
  const std::vector<Tensor<float>> in{uniform<float>({120, 100, 3}, 0, 1, 1)};
  CHECK(run_with_grads<float>(f, in, 1) == run_with_grads<float>(f, in, 2));
}
