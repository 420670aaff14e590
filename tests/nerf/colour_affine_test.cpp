#include <fieldmark/nerf/colour_affine.h>

#include <cmath>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
const std::vector<Index> kImages{2, 0, 0, 1, 2};

auto op() {
  return [](auto&, auto v) { return colour_affine(v[0], v[1], std::span<const Index>(kImages)); };
}
}  // namespace

TEST_CASE("colour_affine: straight colours go through the matrix of their image, opacity stays") {
  const auto rays = uniform({5, 4}, 0, 1, 1), affine = uniform({3, 12}, -0.5, 0.5, 2);
  const auto y = op_values<double>(op(), {rays, affine});
  for (Index r = 0; r < 5; ++r) {
    const double *c = &rays[4 * r], *d = &affine[12 * kImages[static_cast<std::size_t>(r)]];
    for (Index k = 0; k < 3; ++k) {
      const double straight[] = {c[0] / c[3], c[1] / c[3], c[2] / c[3]};
      const double mapped = straight[k] + d[4 * k] * straight[0] + d[4 * k + 1] * straight[1] +
                            d[4 * k + 2] * straight[2] + d[4 * k + 3];
      CHECK(std::abs(y[static_cast<std::size_t>(4 * r + k)] - c[3] * mapped) < 1e-14);
    }
    CHECK(y[static_cast<std::size_t>(4 * r + 3)] == c[3]);
  }
  CHECK(op_values<double>(op(), {rays, Tensor<double>({3, 12})}) == rays.data);
}

TEST_CASE("colour_affine: gradient in rays and matrices, whose images share rows") {
  expect_grad(op(), {uniform({5, 4}, 0, 1, 1), uniform({3, 12}, -0.5, 0.5, 2)});
  expect_grad([](auto&, auto v) { return colour_affine(v[0], v[1], std::span<const Index>()); },
              {Tensor<double>({0, 4}), uniform({1, 12}, -0.5, 0.5, 2)});
}

TEST_CASE("colour_affine: errors name argument and what came") {
  Tape<double> t;
  const Tensor<double> rays({5, 4}), affine({3, 12}), narrow({3, 3}), two({2, 12});
  const auto run = [&](const Tensor<double>& r, const Tensor<double>& a, std::span<const Index> image) {
    colour_affine(t.constant(r), t.constant(a), image);
  };
  CHECK_THROWS_WITH(run(narrow, affine, kImages),
                    "[colour_affine] rays: axis 1 must be 4 (red, green, blue, opacity), got shape [3, 3]");
  CHECK_THROWS_WITH(run(rays, narrow, kImages),
                    "[colour_affine] affine: axis 1 must be 12 (a 3 x 4 matrix), got shape [3, 3]");
  CHECK_THROWS_WITH(run(rays, affine, std::span(kImages).first(2)),
                    "[colour_affine] image must have one element a ray (5), got 2");
  CHECK_THROWS_WITH(run(rays, two, kImages), "[colour_affine] image must be in [0, 2), got 2");
}

TEST_CASE("colour_affine: the same bits for one and two threads") {
  constexpr Index kRays = 100000;
  std::vector<Index> image;
  for (Index i = 0; i < kRays; ++i) image.push_back(i % 7);
  expect_same_bits([&](auto&, auto v) { return colour_affine(v[0], v[1], std::span<const Index>(image)); },
                   {uniform<float>({kRays, 4}, 0, 1, 1), uniform<float>({7, 12}, -1, 1, 2)});
}
