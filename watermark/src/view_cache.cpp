#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/view_cache.h>

#include <algorithm>

namespace fieldmark::watermark {
namespace {

constexpr float kLeastOpacity = 0.02f;  // a ray that sees less is background

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// Traces all pixels: rgba [P, 4], position [P, 3] and direction [P, 3].
void trace_rows(nerf::Renderer& renderer, const nerf::RadianceField& field, const nerf::Camera& camera,
                std::vector<float>& rgba, std::vector<float>& position, std::vector<float>& direction) {
  const Index w = camera.width;
  parallel_for(nerf::Renderer::kLanes, 1, [&](Index lane, Index) {
    std::vector<float> pixels(at(2 * w));
    nerf::CubeRays rays;
    rays.resize(w);
    for (Index y = lane; y < camera.height; y += nerf::Renderer::kLanes) {
      for (Index x = 0; x < w; ++x) {
        pixels[at(2 * x)] = static_cast<float>(x);
        pixels[at(2 * x + 1)] = static_cast<float>(y);
      }
      rays.set(field.space, 0, camera, pixels);
      std::copy(rays.seen_from.begin(), rays.seen_from.end(), direction.begin() + 3 * y * w);
      renderer.trace(rays.batch(field.space), lane, &rgba[at(4 * y * w)], &position[at(3 * y * w)]);
    }
  });
}

}  // namespace

CachedView cache_view(nerf::Renderer& renderer, const nerf::RadianceField& field,
                      const nerf::Camera& camera) {
  const Index h = camera.height, w = camera.width;
  std::vector<float> rgba(at(4 * h * w)), position(at(3 * h * w)), direction(at(3 * h * w));
  trace_rows(renderer, field, camera, rgba, position, direction);
  const float background = nerf::background_value(field.background);
  CachedView view{h, w, Tensor<float>({h, w, 3}), Tensor<float>({h, w}), {0}, {}, {}, {}, {}};
  for (Index p = 0; p < h * w; ++p) {
    const float* c = &rgba[at(4 * p)];
    for (Index a = 0; a < 3; ++a) view.base[3 * p + a] = std::clamp(c[a] + (1 - c[3]) * background, 0.f, 1.f);
    view.opacity[p] = std::min(c[3], 1.f);
    if (c[3] >= kLeastOpacity) {
      for (Index a = 0; a < 3; ++a) {
        view.position.push_back(position[at(3 * p + a)]);
        view.direction.push_back(direction[at(3 * p + a)]);
        view.colour.push_back(std::clamp(c[a] / c[3], 0.f, 1.f));
      }
      view.weight.push_back(view.opacity[p]);
    }
    view.sample_begin.push_back(static_cast<std::int32_t>(view.weight.size()));
  }
  view.camera = camera;
  return view;
}

}  // namespace fieldmark::watermark
