#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/nerf/renderer.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::nerf {
namespace {

constexpr Index kMlpRays = 64;  // of an mlp field at a time: what is kept of a sample is large

// Every other bit of n, the lowest first: a coordinate of the n-th point of a Z-shaped curve.
Index even_bits(Index n) {
  Index out = 0;
  for (Index bit = 0; n >> 2 * bit; ++bit) out |= (n >> 2 * bit & 1) << bit;
  return out;
}

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

struct Renderer::Lane {
  FieldSampler sampler;
  RaySamples samples;
  Tape<float> tape;
  CubeRays rays;
  std::vector<float> pixels, out, weights, positions, seen_from, colours;
  std::vector<std::int32_t> sample_ray, kept;
};

Renderer::Renderer(const RadianceField& field, const RenderOptions& options)
    : field_(field),
      options_(options),
      step_(field.step() / options.finer),
      packed_(field.params,
              {.precision = options.precision, .tables = options.precision == Precision::bf16}) {
  if (!(options.finer > 0))
    throw ValueError("[renderer] finer must be positive, got " + std::to_string(options.finer));
  if (options.order.width < 1 || options.order.height < 1)
    throw ValueError("[renderer] order: a tile must have at least one pixel, got " +
                     std::to_string(options.order.width) + " x " + std::to_string(options.order.height));
  if (options.supersampling < 0 || options.supersampling > kMostSupersampling)
    throw ValueError("[renderer] supersampling must be 1 to 8 rays along a pixel's side, or 0, got " +
                     std::to_string(options.supersampling));
  if (options.supersampling == 0) options_.supersampling = field.options().supersampling;
  refresh();
  for (Index i = 0; i < kLanes; ++i) lanes_.push_back(std::make_unique<Lane>());
}
Renderer::~Renderer() = default;

// Calls use(first ray, rays) after each block of rays, whose samples the lane then holds.
template <class F>
void Renderer::trace_blocks(const RayBatch& rays, Lane& lane, F use) {
  const Index block = field_.coarse ? kMlpRays : rays.size();
  for (Index begin = 0; begin < rays.size(); begin += block) {
    const Index n = std::min(block, rays.size() - begin);
    trace_block(rays.part(begin, n), lane);
    use(begin, n);
  }
}

void Renderer::trace(const RayBatch& rays, Index lane_index, float* out, float* position) {
  Lane& lane = *lanes_[at(lane_index)];
  trace_blocks(rays, lane, [&](Index begin, Index n) {
    accumulate(lane, n, out + 4 * begin, position ? position + 3 * begin : nullptr);
  });
}

void Renderer::trace_samples(const RayBatch& rays, Index lane_index, std::vector<SeenSample>& out) {
  Lane& lane = *lanes_[at(lane_index)];
  out.clear();
  trace_blocks(rays, lane, [&](Index begin, Index) {
    for (std::size_t k = 0; k < lane.kept.size(); ++k) {
      const float *x = &lane.positions[3 * k], *c = &lane.colours[3 * k];
      out.push_back({.ray = begin + lane.sample_ray[k],
                     .weight = lane.weights[static_cast<std::size_t>(lane.kept[k])],
                     .position = {x[0], x[1], x[2]},
                     .colour = {c[0], c[1], c[2]}});
    }
  });
}

void Renderer::trace_block(const RayBatch& rays, Lane& lane) {
  lane.sampler.sample(field_, rays, {},
                      {.finer = options_.finer,
                       .stop = options_.stop,
                       .points = options_.points.value_or(field_.options().points)},
                      lane.samples, &packed_);
  const RaySamples& s = lane.samples;
  lane.weights.resize(at(s.size()));
  sample_weights(s, step_, lane.weights.data());

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
  const Field<float>& net = field_.field;
  const auto rows = [&](const std::vector<float>& all, Index columns) {
    return gather_rows(tape.constant(all.data(), {s.size(), columns}), lane.kept);
  };
  const Var<float> of_ray = net.encode_directions(tape.constant(rays.seen_from.data(), {rays.size(), 3}));
  const Var<float> z = field_.coarse ? rows(s.z, net.geometry_width())
                                     : net.geometry(params, rows(s.density_features, net.density_width()));
  const Var<float> rgb = net.colour(params, z, rows(s.colour_features, net.colour_width()),
                                    gather_rows(of_ray, lane.sample_ray));
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

// The pixels of a tile, in the order in which its rays are traced.
void Renderer::list_pixels(const Camera& camera, Index tile, Lane& lane) const {
  const RayOrder& order = options_.order;
  const Index columns = (camera.width + order.width - 1) / order.width;
  const Index x0 = tile % columns * order.width, y0 = tile / columns * order.height;
  const Index width = std::min(order.width, camera.width - x0),
              height = std::min(order.height, camera.height - y0);
  lane.pixels.clear();
  const auto add = [&](Index x, Index y) {
    lane.pixels.push_back(static_cast<float>(x0 + x));
    lane.pixels.push_back(static_cast<float>(y0 + y));
  };
  if (order.morton) {
    Index side = 1;
    while (side < std::max(width, height)) side *= 2;
    for (Index i = 0; i < side * side; ++i)
      if (const Index x = even_bits(i), y = even_bits(i >> 1); x < width && y < height) add(x, y);
    return;
  }
  for (Index y = 0; y < height; ++y)
    for (Index x = 0; x < width; ++x) add(x, y);
}

Rendering Renderer::render(const Camera& camera) {
  refresh();
  const Index k = options_.supersampling, height = camera.height, width = camera.width;
  if (k == 1) return trace_centres(camera);
  Rendering fine = trace_centres(camera.scaled(k * width, k * height));
  fine.opacity.shape = {k * height, k * width, 1};
  Rendering view{resize_area(fine.rgb, height, width), resize_area(fine.opacity, height, width)};
  view.opacity.shape = {height, width};
  return view;
}

// One ray through the centre of every pixel.
Rendering Renderer::trace_centres(const Camera& camera) {
  Rendering view{Tensor<float>({camera.height, camera.width, 3}),
                 Tensor<float>({camera.height, camera.width})};
  const RayOrder& order = options_.order;
  const Index tiles =
      ((camera.width + order.width - 1) / order.width) * ((camera.height + order.height - 1) / order.height);
  const float background = background_value(field_.background);
  parallel_for(kLanes, 1, [&](Index l, Index) {
    Lane& lane = *lanes_[at(l)];
    for (Index tile = l; tile < tiles; tile += kLanes) {
      list_pixels(camera, tile, lane);
      const auto n = static_cast<Index>(lane.pixels.size()) / 2;
      lane.rays.resize(n);
      lane.out.resize(at(4 * n));
      lane.rays.set(field_.space, 0, camera, lane.pixels);
      trace(lane.rays.batch(field_.space), l, lane.out.data());
      for (Index i = 0; i < n; ++i) {
        const Index pixel = static_cast<Index>(lane.pixels[at(2 * i + 1)]) * camera.width +
                            static_cast<Index>(lane.pixels[at(2 * i)]);
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
