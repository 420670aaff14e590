#include <fieldmark/core/error.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/rendered_dataset.h>

#include <algorithm>

namespace fieldmark::nerf {
namespace {

Tensor<float> straight(const Rendering& r, float background, bool opaque) {
  const Index pixels = r.opacity.size();
  Tensor<float> rgba({r.opacity.shape[0], r.opacity.shape[1], 4});
  for (Index p = 0; p < pixels; ++p) {
    const float a = opaque ? 1.f : r.opacity[p];
    for (Index c = 0; c < 3; ++c) {
      const float seen = r.rgb[3 * p + c];
      rgba[4 * p + c] = opaque ? seen : a > 0 ? std::clamp((seen - (1 - a) * background) / a, 0.f, 1.f) : 0.f;
    }
    rgba[4 * p + 3] = a;
  }
  return quantize8(rgba);
}

}  // namespace

Dataset rendered_dataset(const RadianceField& field, std::span<const Camera> cameras,
                         const std::function<bool(Index done, Index total)>& progress) {
  if (cameras.empty()) throw ValueError("[rendered_dataset] cameras must be at least one, got 0");
  for (const Camera& c : cameras)
    if (c.width != cameras[0].width || c.height != cameras[0].height)
      throw ValueError("[rendered_dataset] cameras must be of one size, " + std::to_string(cameras[0].width) +
                       " x " + std::to_string(cameras[0].height) + ", got " + std::to_string(c.width) +
                       " x " + std::to_string(c.height));
  const bool cube = field.space.kind == SpaceKind::cube;
  Dataset data{.name = "renders",
               .split = "train",
               .background = field.background,
               .views = {},
               .layout = cube ? Layout::blender : Layout::transforms,
               .scene = cube ? SceneType::object : SceneType::place};
  Renderer renderer(field);
  for (const Camera& camera : cameras) {
    const Rendering r = renderer.render(camera);
    data.views.push_back({.camera = camera,
                          .rgba = straight(r, background_value(field.background), !cube),
                          .name = "r_" + std::to_string(data.views.size())});
    if (progress && !progress(std::ssize(data.views), std::ssize(cameras)))
      throw Error("stopped while rendering a data set");
  }
  return data;
}

}  // namespace fieldmark::nerf
