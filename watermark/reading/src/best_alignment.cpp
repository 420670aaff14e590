#include "best_alignment.h"
#include "camera_motion.h"

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr double kRival = 0.05;   // largest gap to the best coarse agreement
constexpr std::size_t kMost = 4;  // cameras aligned finely
constexpr double kAlike = 0.02;   // of the longer side of the image

bool alike(const nerf::Camera& a, const nerf::Camera& b, const std::vector<nerf::Vec3>& points) {
  const double far = kAlike * static_cast<double>(std::max(a.width, a.height));
  return std::ranges::all_of(points, [&](const nerf::Vec3& point) {
    const Projection p = project(a, point), q = project(b, point);
    return p.depth > 0 && q.depth > 0 && std::hypot(p.x - q.x, p.y - q.y) < far;
  });
}

}  // namespace

Alignment best_alignment(std::vector<Alignment> coarse, double enough, const std::vector<nerf::Vec3>& points,
                         const std::function<Alignment(const nerf::Camera&)>& fine) {
  Alignment best;
  std::ranges::stable_sort(coarse, [](const auto& a, const auto& b) { return a.agreement > b.agreement; });
  std::vector<nerf::Camera> tried;
  for (const Alignment& c : coarse) {
    if (!(c.agreement >= 0) || c.agreement < coarse.front().agreement - kRival) break;
    if (tried.size() == kMost || best.agreement >= enough) break;
    if (std::ranges::any_of(tried, [&](const auto& camera) { return alike(camera, c.camera, points); }))
      continue;
    tried.push_back(c.camera);
    const Alignment a = fine(c.camera);
    if (a.agreement > best.agreement) best = a;
  }
  return best;
}

}  // namespace fieldmark::watermark
