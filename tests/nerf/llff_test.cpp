#include "llff.h"
#include <fieldmark/core/error.h>

#include <cmath>
#include <limits>

#include "nerf/format_samples.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

TEST_CASE("llff: axes down, right, backwards become right, up, backwards") {
  const auto views = parse_poses_bounds(llff_file(llff_rows(3)), "p.npy");
  REQUIRE(views.size() == 3);
  CHECK(views[2].pose == Pose{1, 0, 0, 2, 0, 1, 0, 0, 0, 0, 1, 0});
  CHECK((views[2].depth.near == 4 && views[2].depth.far == 10));
  CHECK((views[2].intrinsics.width == 80 && views[2].intrinsics.height == 60 &&
         views[2].intrinsics.fl_x == 70));
}

TEST_CASE("llff: recentring puts the mean camera at the origin and the nearest bound at 4/3") {
  auto views = parse_poses_bounds(llff_file(llff_rows(3)), "p.npy");
  CHECK(recentre_llff(views) == Approx(1 / 1.5));
  CHECK(views[0].depth.near == Approx(4.0 / 3));
  CHECK(views[0].depth.far == Approx(10 / 1.5));
  CHECK(views[2].pose[3] == Approx(1 / 1.5));
  // Rotating and moving all cameras together leaves the views unchanged.
  auto turned = parse_poses_bounds(llff_file(llff_rows(3)), "p.npy");
  const double c = std::cos(0.4), s = std::sin(0.4);
  for (auto& v : turned) {
    const Pose p = v.pose;
    for (std::size_t k = 0; k < 4; ++k) {
      v.pose[k] = c * p[k] - s * p[8 + k], v.pose[4 + k] = p[4 + k], v.pose[8 + k] = s * p[k] + c * p[8 + k];
    }
    v.pose[3] += 5, v.pose[7] -= 2, v.pose[11] += 1;
  }
  recentre_llff(turned);
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t k = 0; k < 12; ++k) CHECK(std::abs(turned[i].pose[k] - views[i].pose[k]) < 1e-12);
}

TEST_CASE("llff: errors name row and number") {
  const auto expect = [](int number, double value, const std::string& message) {
    auto rows = llff_rows(3);
    rows[static_cast<std::size_t>(17 + number)] = value;
    CHECK_THROWS_WITH(parse_poses_bounds(llff_file(rows), "p.npy"), Contains("p.npy: row 1: " + message));
  };
  expect(3, std::nan(""), "number 3: expected a number in (-1e9, 1e9), got ");
  expect(3, std::numeric_limits<double>::infinity(), "number 3: expected a number in (-1e9, 1e9), got inf");
  expect(1, 1.1, "numbers 0 to 12: expected a rotation, got columns that are off orthonormal by 0.21");
  expect(4, 0, "numbers 4 and 9: expected height and width of 1 to 65536 pixels, got ");
  expect(14, -3, "number 14: expected a focal length");
  expect(15, 0, "numbers 15 and 16: expected bounds with 1e-9 < near < far, got 0");
  expect(15, 10, "numbers 15 and 16: expected bounds");
  CHECK_THROWS_WITH(parse_poses_bounds(npy_file("{'descr': '<f8', 'fortran_order': False, 'shape': (17,), }",
                                                packed(llff_rows(1))),
                                       "p.npy"),
                    Contains("p.npy: expected an array of N x 17, N >= 1, got 17"));
  std::vector<LlffView> none;
  CHECK_THROWS_AS(recentre_llff(none), ValueError);
  // Two cameras that look in opposite directions have no mean direction.
  auto views = parse_poses_bounds(llff_file(llff_rows(2)), "p.npy");
  for (const std::size_t k : {0u, 2u}) views[1].pose[k] *= -1, views[1].pose[8 + k] *= -1;
  CHECK_THROWS_WITH(recentre_llff(views), Contains("must have a mean direction"));
}
