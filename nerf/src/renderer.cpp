#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/nerf/spherical_harmonics.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {

constexpr Index kTile = 16;  // pixels a side: rays of a tile pass through the same cells

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

struct Renderer::Lane {
  RaySampler sampler;
  RaySamples samples;
  Tape<float> tape;
  CubeRays rays;
  std::vector<float> pixels, out, weights, positions, seen_from, colours;
  std::vector<std::int32_t> sample_ray, kept;
};

Renderer::Renderer(const RadianceField& field, const RenderOptions& options)
    : field_(field),
      options_(options),
      packed_(field.params,
              {.precision = options.precision, .tables = options.precision == Precision::bf16}) {
  refresh();
  for (Index i = 0; i < kLanes; ++i) lanes_.push_back(std::make_unique<Lane>());
}
Renderer::~Renderer() = default;

void sample_weights(const RaySamples& samples, float step, float* weights) {
  for (std::size_t r = 0; r + 1 < samples.ray_begin.size(); ++r) {
    float transmittance = 1;
    for (Index i = samples.ray_begin[r]; i < samples.ray_begin[r + 1]; ++i) {
      weights[i] = -transmittance * std::expm1(-samples.sigma[at(i)] * step);
      transmittance -= weights[i];
    }
  }
}

void Renderer::trace(const RayBatch& rays, Index lane_index, float* out, float* position) {
  Lane& lane = *lanes_[at(lane_index)];
  lane.sampler.sample(field_.field, field_.params, field_.grid, rays, {},
                      {.step = field_.step(), .stop = options_.stop}, lane.samples, &packed_);
  const RaySamples& s = lane.samples;
  lane.weights.resize(at(s.size()));
  sample_weights(s, field_.step(), lane.weights.data());

  // Colours of the samples that matter, the ray's harmonics repeated for each.
  lane.kept.clear();
  lane.sample_ray.clear();
  for (Index r = 0; r < rays.size(); ++r)
    for (Index i = s.ray_begin[at(r)]; i < s.ray_begin[at(r + 1)]; ++i)
      if (lane.weights[at(i)] > options_.least_weight) {
        lane.kept.push_back(static_cast<std::int32_t>(i));
        lane.sample_ray.push_back(static_cast<std::int32_t>(r));
      }
  lane.tape.reset();
  Tape<float>& tape = lane.tape;
  const Params<float> params(field_.params, nullptr, packed_);
  const Index width = field_.field.encoding().width();
  const auto rows = [&](const std::vector<float>& all, Index columns) {
    return gather_rows(tape.constant(all.data(), {static_cast<Index>(all.size()) / columns, columns}),
                       lane.kept);
  };
  const Var<float> harmonics = spherical_harmonics(tape.constant(rays.seen_from.data(), {rays.size(), 3}));
  const Var<float> rgb =
      field_.field.colour(params, field_.field.geometry(params, rows(s.density_features, width)),
                          rows(s.colour_features, width), gather_rows(harmonics, lane.sample_ray));
  lane.colours.assign(rgb.value(), rgb.value() + rgb.shape().size());
  lane.positions.clear();
  for (std::int32_t i : lane.kept)
    lane.positions.insert(lane.positions.end(), &s.position[3 * static_cast<std::size_t>(i)],
                          &s.position[3 * static_cast<std::size_t>(i)] + 3);
  if (recolour_) {
    lane.seen_from.clear();
    for (std::int32_t r : lane.sample_ray)
      lane.seen_from.insert(lane.seen_from.end(), &rays.seen_from[3 * static_cast<std::size_t>(r)],
                            &rays.seen_from[3 * static_cast<std::size_t>(r)] + 3);
    recolour_(lane.positions.data(), lane.seen_from.data(), static_cast<Index>(lane.kept.size()),
              lane.colours.data());
  }
  accumulate(lane, rays.size(), out, position);
}

void Renderer::accumulate(const Lane& lane, Index rays, float* out, float* position) {
  std::fill_n(out, 4 * rays, 0.f);
  if (position) std::fill_n(position, 3 * rays, 0.f);
  for (std::size_t k = 0; k < lane.kept.size(); ++k) {
    const float w = lane.weights[static_cast<std::size_t>(lane.kept[k])];
    const Index ray = lane.sample_ray[k];
    for (std::size_t a = 0; a < 3; ++a) out[4 * ray + static_cast<Index>(a)] += w * lane.colours[3 * k + a];
    out[4 * ray + 3] += w;
    if (position)
      for (std::size_t a = 0; a < 3; ++a)
        position[3 * ray + static_cast<Index>(a)] += w * lane.positions[3 * k + a];
  }
  if (!position) return;
  for (Index r = 0; r < rays; ++r)
    for (Index a = 0; a < 3; ++a)
      if (out[4 * r + 3] > 0) position[3 * r + a] /= out[4 * r + 3];
}

Rendering Renderer::render(const Camera& camera) {
  refresh();
  Rendering view{Tensor<float>({camera.height, camera.width, 3}),
                 Tensor<float>({camera.height, camera.width})};
  const Index columns = (camera.width + kTile - 1) / kTile,
              tiles = columns * ((camera.height + kTile - 1) / kTile);
  const float background = background_value(field_.background);
  parallel_for(kLanes, 1, [&](Index l, Index) {
    Lane& lane = *lanes_[at(l)];
    for (Index tile = l; tile < tiles; tile += kLanes) {
      const Index x0 = tile % columns * kTile, y0 = tile / columns * kTile;
      const Index x1 = std::min(x0 + kTile, camera.width), y1 = std::min(y0 + kTile, camera.height);
      lane.pixels.clear();
      for (Index y = y0; y < y1; ++y)
        for (Index x = x0; x < x1; ++x) {
          lane.pixels.push_back(static_cast<float>(x));
          lane.pixels.push_back(static_cast<float>(y));
        }
      const Index n = (x1 - x0) * (y1 - y0);
      lane.rays.resize(n);
      lane.out.resize(at(4 * n));
      lane.rays.set(field_.space, 0, camera, lane.pixels);
      trace(lane.rays.batch(field_.space), l, lane.out.data());
      for (Index i = 0; i < n; ++i) {
        const Index pixel = (y0 + i / (x1 - x0)) * camera.width + x0 + i % (x1 - x0);
        const float* c = &lane.out[at(4 * i)];
        for (Index a = 0; a < 3; ++a)
          view.rgb[3 * pixel + a] = std::clamp(c[a] + (1 - c[3]) * background, 0.f, 1.f);
        view.opacity[pixel] = std::min(c[3], 1.f);
      }
    }
  });
  return view;
}

}  // namespace fieldmark::nerf
