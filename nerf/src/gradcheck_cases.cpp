#include <fieldmark/nerf/camera.h>
#include <fieldmark/nerf/gradcheck_cases.h>
#include <fieldmark/nerf/rays.h>

namespace fieldmark::nerf {
namespace {
GradcheckReport check_rays() {
  Camera camera = make_camera(look_at({1.5, -3, 2}, {0.1, 0, 0.2}, {0, 0, 1}), 0.7, 40, 30);
  camera.fy *= 1.1;
  const auto p = camera.parameters();
  const std::vector<Tensor<double>> inputs{{Shape{16}, {p.begin(), p.end()}},
                                           {Shape{3, 2}, {0, 0, 12.25, 29, 39.5, -3}}};
  return gradcheck([](Tape<double>&, auto v) { return rays(v[0], v[1]); }, inputs);
}
}  // namespace

std::vector<GradcheckCase> gradcheck_cases() { return {{"rays", check_rays}}; }

}  // namespace fieldmark::nerf
