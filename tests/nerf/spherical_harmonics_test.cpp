#include <fieldmark/nerf/spherical_harmonics.h>

#include <cmath>
#include <numbers>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
const auto harmonics_op = [](auto&, auto v) { return spherical_harmonics(v[0]); };

double factorial(int n) { return std::tgamma(n + 1.0); }

// Associated Legendre function without the Condon-Shortley phase, by the recurrence in l.
double legendre(int l, int m, double z) {
  double before = 0, now = 1;
  for (int k = 1; k <= m; ++k) now *= (2 * k - 1) * std::sqrt(1 - z * z);
  for (int k = m + 1; k <= l; ++k) {
    const double next = ((2 * k - 1) * z * now - (k + m - 1) * before) / (k - m);
    before = now;
    now = next;
  }
  return now;
}

// Y_lm from its definition in angles, with the Condon-Shortley phase.
double harmonic(int l, int m, double z, double phi) {
  const int a = std::abs(m);
  const double k = std::sqrt((2 * l + 1) / (4 * std::numbers::pi) * factorial(l - a) / factorial(l + a));
  const double angular = m == 0 ? 1 : std::numbers::sqrt2 * (m > 0 ? std::cos(a * phi) : std::sin(a * phi));
  return (a % 2 == 0 ? 1 : -1) * k * legendre(l, a, z) * angular;
}
}  // namespace

TEST_CASE("spherical_harmonics: equal to the definition in angles, within 1e-15 * 10") {
  for (const double z : {-1.0, -0.7, 0.0, 0.3, 0.95})
    for (double phi = -3; phi < 3; phi += 0.37) {
      const double s = std::sqrt(1 - z * z);
      const Tensor<double> d(Shape{1, 3}, {s * std::cos(phi), s * std::sin(phi), z});
      const auto y = op_values<double>(harmonics_op, {d});
      for (int l = 0; l < 4; ++l)
        for (int m = -l; m <= l; ++m) {
          CAPTURE(l, m, z, phi);
          CHECK(std::abs(y[static_cast<std::size_t>(l * l + l + m)] - harmonic(l, m, z, phi)) < 1e-14);
        }
    }
}

TEST_CASE("spherical_harmonics: orthonormal on the sphere, within 1e-14") {
  // Exact for these polynomials: 4 Gauss points in z (degree 7) and 16 equal steps in azimuth.
  const double node[] = {-0.86113631159405258, -0.33998104358485626, 0.33998104358485626,
                         0.86113631159405258};
  const double weight[] = {0.34785484513745386, 0.65214515486254614, 0.65214515486254614,
                           0.34785484513745386};
  Tensor<double> d(Shape{64, 3});
  for (Index i = 0; i < 64; ++i) {
    const double z = node[i / 16], phi = 2 * std::numbers::pi * static_cast<double>(i % 16) / 16;
    d[3 * i] = std::sqrt(1 - z * z) * std::cos(phi);
    d[3 * i + 1] = std::sqrt(1 - z * z) * std::sin(phi);
    d[3 * i + 2] = z;
  }
  const auto y = op_values<double>(harmonics_op, {d});
  for (std::size_t a = 0; a < 16; ++a)
    for (std::size_t b = 0; b < 16; ++b) {
      double sum = 0;
      for (std::size_t i = 0; i < 64; ++i)
        sum += weight[i / 16] * std::numbers::pi / 8 * y[16 * i + a] * y[16 * i + b];
      CAPTURE(a, b);
      CHECK(std::abs(sum - (a == b ? 1 : 0)) < 1e-14);
    }
}

TEST_CASE("spherical_harmonics: gradient, also off the sphere") {
  for (const Index n : {0, 1, 7}) expect_grad(harmonics_op, {uniform({n, 3}, -1.5, 1.5, 3)});
  expect_grad(harmonics_op, {Tensor<double>(Shape{2, 3})});
}

TEST_CASE("spherical_harmonics: float within 1e-6 of double") {
  CHECK(float_error(harmonics_op, {uniform<float>({300, 3}, -1, 1, 4)}) < 1e-6);
  CHECK(float_error_to_130(harmonics_op, [](Index e) {
          return std::vector{uniform<float>({e, 3}, -1, 1, 5)};
        }) < 1e-6);
}

TEST_CASE("spherical_harmonics: errors name argument and shape") {
  Tape<float> t;
  const Tensor<float> row(Shape{3}), wide(Shape{2, 4});
  CHECK_THROWS_WITH(spherical_harmonics(t.constant(row)),
                    "[spherical_harmonics] d must have rank 2 [N, 3], got shape [3]");
  CHECK_THROWS_WITH(spherical_harmonics(t.constant(wide)),
                    "[spherical_harmonics] d: axis 1 must be 3 (x, y, z), got shape [2, 4]");
}

TEST_CASE("spherical_harmonics: the same bits for one and two threads") {
  expect_same_bits(harmonics_op, {uniform<float>({9000, 3}, -1, 1, 5)});
}
