#include "best_alignment.h"

#include <map>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
const std::vector<nerf::Vec3> kPoints{{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 0.5}};

// Returns a camera of 100 pixels that looks at the origin from z = 4 and is moved to the right.
nerf::Camera camera_at(double right) {
  nerf::Camera c;
  c.pose = nerf::look_at({0, 0, 4}, {0, 0, 0}, {0, 1, 0});
  c.width = c.height = 100;
  c.fx = c.fy = 100;
  c.cx = c.cy = 50;
  c.cx += right;
  return c;
}

struct Choice {
  double camera, agreement;
  std::vector<double> tried;
};

// Chooses among cameras with coarse agreements; `fine` has their fine ones.
Choice choose(const std::vector<std::pair<double, double>>& coarse, std::map<double, double> fine,
              double enough = 0.95) {
  std::vector<Alignment> found;
  for (const auto& [right, agreement] : coarse) found.push_back({camera_at(right), agreement});
  Choice out{};
  const Alignment best = best_alignment(found, enough, kPoints, [&](const nerf::Camera& camera) {
    out.tried.push_back(camera.cx - 50);
    return Alignment{camera, fine.at(camera.cx - 50)};
  });
  out.camera = best.camera.cx - 50;
  out.agreement = best.agreement;
  return out;
}
}  // namespace

TEST_CASE("best_alignment: the camera that agrees most when fine wins, not the best coarse one") {
  const Choice c = choose({{0, 0.88}, {10, 0.90}, {20, 0.87}}, {{0, 0.97}, {10, 0.86}, {20, 0.99}});
  CHECK(c.tried == std::vector<double>{10, 0});  // 0.97 is enough
  CHECK(c.camera == 0);
  CHECK(c.agreement == 0.97);
  CHECK(choose({{0, 0.88}, {10, 0.90}, {20, 0.87}}, {{0, 0.97}, {10, 0.86}, {20, 0.99}}, 0.98).camera == 20);
}

TEST_CASE("best_alignment: at most four cameras, 0.05 below the best, each once") {
  const std::map<double, double> none{{0, 0.8}, {10, 0.7}, {20, 0.6}, {30, 0.5}, {40, 0.4}};
  CHECK(choose({{0, 0.9}, {10, 0.9}, {20, 0.9}, {30, 0.9}, {40, 0.9}}, none).tried ==
        std::vector<double>{0, 10, 20, 30});
  CHECK(choose({{0, 0.9}, {10, 0.86}, {20, 0.84}}, none).tried == std::vector<double>{0, 10});
  CHECK(choose({{0, 0.9}, {1, 0.89}, {10, 0.88}}, none).tried == std::vector<double>{0, 10});
  CHECK(choose({{0, -1}, {10, -1}}, none).tried.empty());
  CHECK(choose({{0, -1}}, none).agreement == -1);
  CHECK(choose({}, none).agreement == -1);
}
