#include <fieldmark/distort/rescale.h>

#include "distort/support.h"
#include "support/expect_grad.h"

using namespace fieldmark;
using distort::rescale;
using distort::rescale_labels;

namespace {
const auto zoom = [](auto&, auto v) { return rescale(v[0], v[1]); };

template <class T>
void check_identity() {
  for (Shape s : {Shape{1, 1, 3}, Shape{5, 8, 3}, Shape{4, 3, 1}}) {
    const auto x = uniform<T>(s, 0, 1, 1);
    CHECK(run_op<T>(zoom, {x, number<T>(1)}).data == x.data);
  }
}
}  // namespace

TEST_CASE("rescale: scale 1 is the exact identity") {
  check_identity<float>();
  check_identity<double>();
}

TEST_CASE("rescale: a linear ramp zooms about the centre, into another size too") {
  Tensor<double> x({9, 11, 1});
  for (Index i = 0; i < x.size(); ++i)
    x[i] = 0.05 * static_cast<double>(i % 11 - 5) - 0.02 * static_cast<double>(i / 11 - 4);
  for (double s : {1.5, 0.8}) {
    const auto y = run_op<double>(
        [](auto&, auto v) { return rescale(v[0], v[1], {.height = 6, .width = 8}); }, {x, number<double>(s)});
    for (Index i = 0; i < 6; ++i)
      for (Index j = 0; j < 8; ++j)
        CHECK(y[i * 8 + j] ==
              Approx((0.05 * (static_cast<double>(j) - 3.5) - 0.02 * (static_cast<double>(i) - 2.5)) / s)
                  .margin(1e-14));
  }
}

TEST_CASE("rescale: halving and doubling, colours and labels") {
  const Tensor<float> x({2, 2, 1}, {0, 1, 2, 3});
  const auto small = run_op<float>(
      [](auto&, auto v) { return rescale(v[0], v[1], {.height = 1, .width = 1}); }, {x, number<float>(0.5)});
  CHECK(small.data == std::vector<float>{1.5f});
  const Tensor<std::int32_t> labels({2, 2}, {1, 2, 3, 4});
  CHECK(rescale_labels(labels, 2.0, 0, 4, 4).data ==
        std::vector<std::int32_t>{1, 1, 2, 2, 1, 1, 2, 2, 3, 3, 4, 4, 3, 3, 4, 4});
  CHECK(rescale_labels(labels, 1.f, 0).data == labels.data);
  CHECK(rescale_labels(labels, 0.5f, 9, 3, 3).data == std::vector<std::int32_t>{9, 9, 9, 9, 4, 9, 9, 9, 9});
}

TEST_CASE("rescale: gradient in image and scale") {
  const auto f = [](auto&, auto v) { return rescale(v[0], v[1], {.height = 4, .width = 4}); };
  expect_grad(f, {uniform({5, 6, 3}, 0, 1, 1), number<double>(0.77)}, {.step = 0.02});
  expect_grad(zoom, {uniform({6, 5, 1}, 0, 1, 1), number<double>(1.31)}, {.step = 0.02});
}

TEST_CASE("rescale: errors and threads") {
  Tape<float> tape;
  const Tensor<float> x({2, 2, 3}), zero({1});
  CHECK_THROWS_WITH(rescale(tape.constant(x), tape.constant(zero)),
                    "[similarity] scale: must be in 1e-06 to 1e+06 (a zoom factor), got 0");
  const std::vector<Tensor<float>> in{uniform<float>({120, 110, 3}, 0, 1, 1), number<float>(0.85)};
  CHECK(run_with_grads<float>(zoom, in, 1) == run_with_grads<float>(zoom, in, 2));
}
