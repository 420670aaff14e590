#include "field_reference.h"
#include <fieldmark/core/error.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace fieldmark::bench {
namespace {

constexpr Index kLanes = 16, kRays = 8;  // rays of a chunk: their samples stay within a few megabytes
constexpr double kLeastWeight = 1e-12;

// Returns the interval of a ray inside the unit cube; empty (near >= far) if they do not meet.
std::array<double, 2> span_of(const nerf::Vec3& o, const nerf::Vec3& d) {
  double near = 0, far = std::numeric_limits<double>::infinity();
  for (std::size_t a = 0; a < 3; ++a) {
    if (d[a] == 0) {
      if (!(o[a] >= 0 && o[a] <= 1)) return {};
      continue;
    }
    const double t0 = -o[a] / d[a], t1 = (1 - o[a]) / d[a];
    near = std::max(near, std::min(t0, t1));
    far = std::min(far, std::max(t0, t1));
  }
  return {near, far};
}

bool occupied(const nerf::OccupancyGrid& grid, const nerf::Vec3& x) {
  std::array<Index, 3> c{};
  for (std::size_t a = 0; a < 3; ++a)
    c[a] = std::clamp<Index>(static_cast<Index>(x[a] * static_cast<double>(grid.resolution())), 0,
                             grid.resolution() - 1);
  return grid.occupied(grid.cell(c[0], c[1], c[2]));
}

}  // namespace

struct FieldReference::Lane {
  Tape<double> tape;
  std::vector<double> x, d, delta, density_features, colour_features, weights;
  std::vector<Index> ray_begin;
  std::vector<std::int32_t> kept, ray;
};

FieldReference::FieldReference(const nerf::RadianceField& field, const ReferenceOptions& options)
    : source_(field), options_(options), field_(params_, field.options().field, 0) {
  if (options.samples < 1)
    throw ValueError("[field_reference] samples must be at least 1, got " + std::to_string(options.samples));
  if (field.coarse || field.space.kind != nerf::SpaceKind::cube)
    throw ValueError(
        "[field_reference] field must have a hash table and lie in a cube (others have no reference yet), "
        "got " +
        std::string(field.coarse ? "kind mlp" : "space " + nerf::name_of(field.space.kind)));
  std::copy(field.params.values().begin(), field.params.values().end(), params_.values().begin());
  for (Index i = 0; i < kLanes; ++i) lanes_.push_back(std::make_unique<Lane>());
}
FieldReference::~FieldReference() = default;

std::vector<double> FieldReference::trace(const nerf::Camera& camera, std::span<const Index> pixels) {
  for (const Index p : pixels)
    if (p < 0 || p >= camera.width * camera.height)
      throw ValueError("[field_reference] pixels must lie in the image of " +
                       std::to_string(camera.width * camera.height) + ", got " + std::to_string(p));
  const Index n = static_cast<Index>(pixels.size());
  std::vector<double> out(at(4 * n));
  parallel_for(kLanes, 1, [&](Index l, Index) {
    for (Index begin = l * kRays; begin < n; begin += kLanes * kRays)
      trace_piece(camera, pixels.subspan(at(begin), at(std::min(kRays, n - begin))), *lanes_[at(l)],
                  &out[at(4 * begin)]);
  });
  return out;
}

std::vector<double> FieldReference::render(const nerf::Camera& camera) {
  std::vector<Index> pixels(at(camera.width * camera.height));
  std::iota(pixels.begin(), pixels.end(), Index{0});
  return trace(camera, pixels);
}

// Adds the samples of a ray that contribute.
void FieldReference::add_ray(const nerf::Ray& ray, Lane& lane) const {
  nerf::Vec3 o;
  for (std::size_t a = 0; a < 3; ++a)
    o[a] = (ray.origin[a] - source_.space.bounds.corner[a]) / source_.space.bounds.side;
  const auto [near, far] = span_of(o, ray.direction);
  const double delta = (far - near) / static_cast<double>(options_.samples);
  for (Index k = 0; near < far && k < options_.samples; ++k) {
    const double t = near + (static_cast<double>(k) + 0.5) * delta;
    nerf::Vec3 x;
    for (std::size_t a = 0; a < 3; ++a) x[a] = o[a] + t * ray.direction[a];
    if (options_.occupancy && !occupied(source_.grid, x)) continue;
    lane.x.insert(lane.x.end(), x.begin(), x.end());
    lane.delta.push_back(delta);
  }
  lane.d.insert(lane.d.end(), ray.direction.begin(), ray.direction.end());
  lane.ray_begin.push_back(static_cast<Index>(lane.delta.size()));
}

void FieldReference::trace_piece(const nerf::Camera& camera, std::span<const Index> pixels, Lane& lane,
                                 double* out) const {
  for (auto* list : {&lane.x, &lane.d, &lane.delta}) list->clear();
  lane.ray_begin.assign(1, 0);
  for (const Index p : pixels) {
    const Index column = p % camera.width, row = p / camera.width;
    add_ray(nerf::pixel_ray(camera, static_cast<double>(column), static_cast<double>(row)), lane);
  }
  const auto n = static_cast<Index>(lane.delta.size()), rays = static_cast<Index>(pixels.size());
  const auto background = static_cast<double>(nerf::background_value(source_.background));
  std::fill_n(out, 4 * rays, 0);
  if (n > 0) {
    const Index width = field_.density_width(), colour_width = field_.colour_width();
    lane.density_features.resize(at(n * width));
    lane.colour_features.resize(at(n * colour_width));
    lane.weights.resize(at(n));
    field_.encode(params_, lane.x.data(), n, lane.density_features.data(), lane.colour_features.data());
    lane.tape.reset();
    const Params<double> params(params_, nullptr);
    const Var<double> z =
        field_.geometry(params, lane.tape.constant(lane.density_features.data(), {n, width}));
    const double* sigma = field_.density(z).value();
    lane.kept.clear();
    lane.ray.clear();
    for (Index r = 0; r < rays; ++r) {
      double depth = 0;
      for (Index i = lane.ray_begin[at(r)]; i < lane.ray_begin[at(r + 1)]; ++i) {
        const double layer = sigma[i] * lane.delta[at(i)];
        lane.weights[at(i)] = -std::exp(-depth) * std::expm1(-layer);
        depth += layer;
        out[4 * r + 3] += lane.weights[at(i)];
        if (!(lane.weights[at(i)] > kLeastWeight)) continue;
        lane.kept.push_back(static_cast<std::int32_t>(i));
        lane.ray.push_back(static_cast<std::int32_t>(r));
      }
    }
    const Var<double> harmonics = field_.encode_directions(lane.tape.constant(lane.d.data(), {rays, 3}));
    const Var<double> colour_features = lane.tape.constant(lane.colour_features.data(), {n, colour_width});
    const Var<double> rgb =
        field_.colour(params, gather_rows(z, lane.kept), gather_rows(colour_features, lane.kept),
                      gather_rows(harmonics, lane.ray));
    for (std::size_t k = 0; k < lane.kept.size(); ++k)
      for (std::size_t a = 0; a < 3; ++a)
        out[4 * static_cast<std::size_t>(lane.ray[k]) + a] +=
            lane.weights[static_cast<std::size_t>(lane.kept[k])] * rgb.value()[3 * k + a];
  }
  for (Index r = 0; r < rays; ++r)
    for (Index a = 0; a < 3; ++a) out[4 * r + a] += (1 - out[4 * r + 3]) * background;
}

}  // namespace fieldmark::bench
