#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/nerf/field_sampler.h>
#include <fieldmark/nerf/renderer.h>

#include <algorithm>
#include <cmath>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

constexpr Index kMlpRays = 64;  // of an mlp field at a time, because its samples take much memory
constexpr Index kTile = 16;     // pixels along a side; rays of a tile pass through the same cells

// Copies points, [.., 3]: to[k] = from[rows[k]].
void gather_points(std::span<const float> from, const std::vector<std::int32_t>& rows,
                   std::vector<float>& to) {
  to.resize(3 * rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (std::size_t a = 0; a < 3; ++a) to[3 * k + a] = from[3 * at(rows[k]) + a];
}

// Returns the offsets of the k x k parts of each pixel, in pixels of the image that has those parts as
// pixels.
PixelOffsets finer_offsets(const PixelOffsets& offsets, Index width, Index k) {
  PixelOffsets finer(offsets.size() * at(k * k));
  for (Index p = 0; p < std::ssize(finer); ++p) {
    const Index x = p % (k * width) / k, y = p / (k * width) / k;
    const auto [right, down] = offsets[at(y * width + x)];
    finer[at(p)] = {static_cast<float>(k) * right, static_cast<float>(k) * down};
  }
  return finer;
}

}  // namespace

struct Renderer::Lane {
  FieldSampler sampler;
  RaySamples samples;
  Tape<float> tape;
  CubeRays rays;
  std::vector<Index> pixels;
  std::vector<float> places, out, weights, positions, seen_from, colours;
  std::vector<std::int32_t> sample_ray, kept;

  void list_pixels(const Camera& camera, Index tile, const PixelOffsets* offsets);
  void accumulate(Index count, float* out, float* position) const;
};

Renderer::Renderer(const RadianceField& field, const RenderOptions& options)
    : field_(field),
      options_(options),
      step_(field.step() / options.finer),
      packed_(field.params,
              {.precision = options.precision, .tables = options.precision == Precision::bf16}) {
  if (!(options.finer > 0))
    throw ValueError("[renderer] finer must be positive, got " + number_text(options.finer));
  check_range("renderer", "supersampling", options.supersampling, 0, kMostSupersampling);
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
    lane.accumulate(n, out + 4 * begin, position ? position + 3 * begin : nullptr);
  });
}

void Renderer::trace_samples(const RayBatch& rays, Index lane_index, std::vector<SeenSample>& out) {
  Lane& lane = *lanes_[at(lane_index)];
  out.clear();
  trace_blocks(rays, lane, [&](Index begin, Index) {
    for (std::size_t k = 0; k < lane.kept.size(); ++k) {
      const float *x = &lane.positions[3 * k], *c = &lane.colours[3 * k];
      out.push_back({.ray = begin + lane.sample_ray[k],
                     .weight = lane.weights[at(lane.kept[k])],
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

  // Computes the colours of the samples that matter, repeating the ray's encoded direction for each.
  lane.kept.clear();
  lane.sample_ray.clear();
  for (Index r = 0; r < rays.size(); ++r)
    for (Index i = s.ray_begin[at(r)]; i < s.ray_begin[at(r + 1)]; ++i)
      if (lane.weights[at(i)] > options_.least_weight) {
        lane.kept.push_back(static_cast<std::int32_t>(i));
        lane.sample_ray.push_back(static_cast<std::int32_t>(r));
      }
  gather_points(s.position, lane.kept, lane.positions);
  if (recolour_) gather_points(rays.seen_from, lane.sample_ray, lane.seen_from);
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
  if (recolour_)
    recolour_(lane.positions.data(), lane.seen_from.data(), static_cast<Index>(lane.kept.size()),
              lane.colours.data());
}

void Renderer::Lane::accumulate(Index count, float* to, float* position) const {
  std::fill_n(to, 4 * count, 0.f);
  if (position) std::fill_n(position, 3 * count, 0.f);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const float w = weights[at(kept[k])];
    const Index ray = sample_ray[k];
    for (Index a = 0; a < 3; ++a) to[4 * ray + a] += w * colours[3 * k + at(a)];
    to[4 * ray + 3] += w;
    for (Index a = 0; position && a < 3; ++a) position[3 * ray + a] += w * positions[3 * k + at(a)];
  }
  for (Index i = 0; position && i < 3 * count; ++i)
    if (to[4 * (i / 3) + 3] > 0) position[i] /= to[4 * (i / 3) + 3];
}

// Lists the pixels of a tile, row by row, and the places that their rays go through.
void Renderer::Lane::list_pixels(const Camera& camera, Index tile, const PixelOffsets* offsets) {
  const Index columns = (camera.width + kTile - 1) / kTile;
  const Index x0 = tile % columns * kTile, y0 = tile / columns * kTile;
  pixels.clear(), places.clear();
  for (Index y = y0; y < std::min(y0 + kTile, camera.height); ++y)
    for (Index x = x0; x < std::min(x0 + kTile, camera.width); ++x) {
      const Index pixel = y * camera.width + x;
      const auto [right, down] = offsets ? (*offsets)[at(pixel)] : std::array{0.f, 0.f};
      pixels.push_back(pixel);
      places.insert(places.end(), {static_cast<float>(x) + right, static_cast<float>(y) + down});
    }
}

Rendering Renderer::render(const Camera& camera, const PixelOffsets* offsets) {
  refresh();
  const Index k = options_.supersampling, height = camera.height, width = camera.width;
  if (offsets && std::ssize(*offsets) != height * width)
    throw ValueError("[render] offsets must be of the camera's " + std::to_string(height * width) +
                     " pixels, got " + std::to_string(offsets->size()));
  if (k == 1) return trace_pixels(camera, offsets);
  const PixelOffsets finer = offsets ? finer_offsets(*offsets, width, k) : PixelOffsets{};
  Rendering fine = trace_pixels(camera.scaled(k * width, k * height), offsets ? &finer : nullptr);
  fine.opacity.shape = {k * height, k * width, 1};
  Rendering view{resize_area(fine.rgb, height, width), resize_area(fine.opacity, height, width)};
  view.opacity.shape = {height, width};
  return view;
}

// Traces one ray a pixel.
Rendering Renderer::trace_pixels(const Camera& camera, const PixelOffsets* offsets) {
  Rendering view{Tensor<float>({camera.height, camera.width, 3}),
                 Tensor<float>({camera.height, camera.width})};
  const Index tiles = ((camera.width + kTile - 1) / kTile) * ((camera.height + kTile - 1) / kTile);
  const float background = background_value(field_.background);
  parallel_for(kLanes, 1, [&](Index l, Index) {
    Lane& lane = *lanes_[at(l)];
    for (Index tile = l; tile < tiles; tile += kLanes) {
      lane.list_pixels(camera, tile, offsets);
      const auto n = std::ssize(lane.pixels);
      lane.rays.resize(n);
      lane.out.resize(at(4 * n));
      lane.rays.set(field_.space, 0, camera, lane.places);
      trace(lane.rays.batch(field_.space), l, lane.out.data());
      for (Index i = 0; i < n; ++i) {
        const Index pixel = lane.pixels[at(i)];
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
