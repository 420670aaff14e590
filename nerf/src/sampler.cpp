#include "sampler.h"

#include <fieldmark/core/number_text.h>

#include <algorithm>
#include <cmath>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

// Samples per ray in a wave: few, so that few lie behind the surface; more once few rays are left, because
// each wave has a fixed cost.
constexpr Index kLeastWave = 4, kMostWave = 16, kWaveSamples = 192;

}  // namespace

void check_rays(const char* op, const RayBatch& rays, std::span<const float> jitter, float step) {
  const auto where = [op] {
    return "[" + std::string(op) + "] ";
  };  // used only for errors: steps allocate nothing
  check_number(op, "step", step, step > 0, "positive");
  if (rays.origins.size() != rays.directions.size() || rays.origins.size() % 3 != 0)
    throw ShapeError(where() + "origins and directions must both be [R, 3], got " +
                     std::to_string(rays.origins.size()) + " and " + std::to_string(rays.directions.size()) +
                     " elements");
  if (!jitter.empty() && static_cast<Index>(jitter.size()) != rays.size())
    throw ShapeError(where() + "jitter must have one element a ray (" + std::to_string(rays.size()) +
                     "), got " + std::to_string(jitter.size()));
}

void RaySampler::sample(const Field<float>& field, const ParamStore<float>& params, const OccupancyGrid& grid,
                        const RayBatch& rays, std::span<const float> jitter, const SamplingOptions& options,
                        RaySamples& out, const PackedWeights<float>* packed) {
  check_rays("sampler", rays, jitter, options.step);
  walks_.clear();
  alive_.clear();
  segments_.clear();
  for (auto* buffer : {&t_, &x_}) buffer->clear();  // the others are written from their first row on
  for (Index r = 0; r < rays.size(); ++r) {
    const float *o = &rays.origins[at(3 * r)], *d = &rays.directions[at(3 * r)];
    const float shift = jitter.empty() ? 0.5f : jitter[at(r)];
    walks_.push_back(rays.contracted ? RayWalk::contracted(o, d, options.step, shift, rays.near)
                                     : RayWalk(o, d, options.step, shift));
    alive_.push_back(r);
  }
  transmittance_.assign(at(rays.size()), 1.f);
  while (!alive_.empty()) {
    const auto first_row = static_cast<Index>(t_.size());
    const std::size_t first_segment = segments_.size();
    march_wave(grid);
    evaluate(field, params, packed, first_row);
    stop_rays(options, first_segment);
  }
  pack(rays.size(), field.density_width(), field.colour_width(), out);
}

// Adds a segment for each live ray; rays that end leave the list.
void RaySampler::march_wave(const OccupancyGrid& grid) {
  std::size_t kept = 0;
  RayWalk::skip_empty(grid, walks_, alive_);
  const Index wave = std::clamp(kWaveSamples / static_cast<Index>(alive_.size()), kLeastWave, kMostWave);
  for (Index r : alive_) {
    float t[kMostWave], x[3 * kMostWave];
    const Index count = walks_[at(r)].next(grid, wave, t, x);
    if (count > 0) segments_.push_back({r, static_cast<Index>(t_.size()), count});
    t_.insert(t_.end(), t, t + count);
    x_.insert(x_.end(), x, x + 3 * count);
    if (count == wave) alive_[kept++] = r;
  }
  alive_.resize(kept);
}

void RaySampler::evaluate(const Field<float>& field, const ParamStore<float>& params,
                          const PackedWeights<float>* packed, Index first) {
  const Index n = static_cast<Index>(t_.size()) - first, width = field.density_width();
  if (n == 0) return;
  // Never shrinks: growing by a wave would fill elements that are about to be overwritten.
  const auto rows = at(first + n);
  if (sigma_.size() < rows) {
    sigma_.resize(rows);
    density_features_.resize(rows * at(width));
    colour_features_.resize(rows * at(field.colour_width()));
  }
  float* features = density_features_.data() + first * width;
  field.encode(params, x_.data() + 3 * first, n, features,
               colour_features_.data() + first * field.colour_width(), packed);
  tape_.reset();
  const Params<float> weights =
      packed ? Params<float>(params, nullptr, *packed) : Params<float>(params, nullptr);
  const Var<float> z = field.geometry(weights, tape_.constant(features, {n, width}));
  std::copy_n(field.density(z).value(), n, sigma_.data() + first);
}

// Cuts segments where the transmittance falls below the threshold. Keeps the sample that crosses it, because
// it stops the light.
void RaySampler::stop_rays(const SamplingOptions& options, std::size_t first_segment) {
  for (std::size_t s = first_segment; s < segments_.size(); ++s) {
    Segment& segment = segments_[s];
    float& transmittance = transmittance_[at(segment.ray)];
    for (Index i = 0; i < segment.count; ++i) {
      transmittance *= std::exp(-sigma_[at(segment.row + i)] * options.step);
      if (transmittance < options.stop) segment.count = i + 1;
    }
  }
  std::erase_if(alive_, [&](Index r) { return transmittance_[at(r)] < options.stop; });
}

// Waves hold segments of many rays; the packed form holds one ray after another. Counting the samples of each
// ray gives the place of every segment, in the order of the waves.
void RaySampler::pack(Index rays, Index density, Index colour, RaySamples& out) {
  out.ray_begin.assign(at(rays + 1), 0);
  for (const Segment& s : segments_) out.ray_begin[at(s.ray + 1)] += s.count;
  for (std::size_t r = 1; r < out.ray_begin.size(); ++r) out.ray_begin[r] += out.ray_begin[r - 1];
  const Index total = out.ray_begin.back();
  out.delta.clear();
  out.z.clear();
  out.t.resize(at(total));
  out.sigma.resize(at(total));
  out.position.resize(at(3 * total));
  out.density_features.resize(at(total * density));
  out.colour_features.resize(at(total * colour));
  place_.assign(out.ray_begin.begin(), out.ray_begin.end() - 1);
  for (const Segment& s : segments_) {
    const Index to = place_[at(s.ray)];
    place_[at(s.ray)] += s.count;
    std::copy_n(t_.data() + s.row, s.count, out.t.data() + to);
    std::copy_n(sigma_.data() + s.row, s.count, out.sigma.data() + to);
    std::copy_n(x_.data() + 3 * s.row, 3 * s.count, out.position.data() + 3 * to);
    std::copy_n(density_features_.data() + s.row * density, s.count * density,
                out.density_features.data() + to * density);
    std::copy_n(colour_features_.data() + s.row * colour, s.count * colour,
                out.colour_features.data() + to * colour);
  }
}

}  // namespace fieldmark::nerf
