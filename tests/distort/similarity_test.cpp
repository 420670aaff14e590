#include <fieldmark/distort/similarity.h>

#include <numbers>

#include "distort/support.h"
#include "support/expect_grad.h"

using namespace fieldmark;
using distort::similarity;
using distort::similarity_matrix;

TEST_CASE("similarity: undoes p to scale R p + shift, counter-clockwise as seen") {
  const double angle = 0.4, scale = 1.7, sx = 3, sy = -2;
  const auto m = similarity_matrix(angle, scale, sx, sy);
  // y points down: a positive turn moves the point (1, 0) on the right up to (cos, -sin).
  const double c = std::cos(angle), s = std::sin(angle);
  for (const auto& p : {std::pair{1.0, 0.0}, {0.0, 1.0}, {-2.5, 0.75}}) {
    const double x = scale * (c * p.first + s * p.second) + sx,
                 y = scale * (-s * p.first + c * p.second) + sy;
    CHECK(m[0] * x + m[1] * y + m[2] == Approx(p.first).margin(1e-14));
    CHECK(m[3] * x + m[4] * y + m[5] == Approx(p.second).margin(1e-14));
  }
}

TEST_CASE("similarity: quarter turns are exact") {
  CHECK(similarity_matrix(std::numbers::pi / 2, 1., 0., 0.)[0] == 0);
  for (int quarter = -4; quarter <= 4; ++quarter) {
    const auto m =
        similarity_matrix(std::numbers::pi_v<float> / 2 * static_cast<float>(quarter), 1.f, 0.f, 0.f);
    const float c[] = {1, 0, -1, 0};
    CHECK(m[0] == c[(quarter + 4) % 4]);
    CHECK(m[3] == c[(quarter + 7) % 4]);
    CHECK(m[1] == -m[3]);
    CHECK(m[4] == m[0]);
  }
}

TEST_CASE("similarity: the op gives the function's numbers, and its gradient") {
  const auto f = [](auto&, auto v) { return similarity(v[0], v[1], v[2]); };
  const std::vector<Tensor<double>> in{number<double>(-0.3), number<double>(0.6),
                                       Tensor<double>({2}, {1.5, -4})};
  const auto y = op_result<double>(f, in);
  const auto want = similarity_matrix(-0.3, 0.6, 1.5, -4.);
  CHECK(std::equal(want.begin(), want.end(), y.data.begin()));
  expect_grad(f, in);
  expect_grad(f, {number<double>(std::numbers::pi / 2), number<double>(1), Tensor<double>({2})});
  CHECK(run_with_grads<double>(f, in, 1) == run_with_grads<double>(f, in, 2));
}

TEST_CASE("similarity: errors") {
  CHECK_THROWS_WITH(similarity_matrix(0., 0., 0., 0.),
                    "[similarity] scale: must be in 1e-06 to 1e+06 (a zoom factor), got 0");
  CHECK_THROWS_WITH(similarity_matrix(std::nan(""), 1., 0., 0.), Contains("[similarity] angle: must be in"));
  Tape<float> tape;
  const Tensor<float> one({1}, 1.f), two({2});
  const auto a = tape.constant(one), b = tape.constant(two);
  CHECK_THROWS_WITH(similarity(a, a, a),
                    "[similarity] shift: axis 0 must be 2 (its layout is [2]), got shape [1]");
  CHECK_THROWS_AS(similarity(b, a, b), ShapeError);
  CHECK_THROWS_AS(similarity(a, b, b), ShapeError);
}
