#include "hierarchical_sampler.h"

#include <algorithm>
#include <bit>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

constexpr double kFloor = 3e-4;  // see importance_points()
constexpr Index kSpans = 64;     // occupied stretches per ray to reserve at the first call

void check(const RayBatch& rays, std::span<const float> jitter, float step, const RayPoints& points) {
  check_range("hierarchical_sampler", "average", points.average, 0, 1024);
  check_range("hierarchical_sampler", "importance", points.importance, 0, 1024);
  check_range("hierarchical_sampler", "random", points.random, 0, 1024);
  if (points.first() == 0)
    throw ValueError(
        "[hierarchical_sampler] average or random must be at least 1 (importance points are drawn from their "
        "weights), got 0 and 0");
  if (rays.contracted)
    throw ValueError(
        "[hierarchical_sampler] rays must be straight in the cube (points are spread by length), got "
        "contracted ones");
  check_rays("hierarchical_sampler", rays, jitter, step);
}

// Hashes a ray (FNV-1a over the words of its floats).
std::uint64_t ray_seed(const float* origin, const float* direction) {
  std::uint64_t h = 0xcbf29ce484222325u;
  for (const float* v : {origin, direction})
    for (int a = 0; a < 3; ++a) h = (h ^ std::bit_cast<std::uint32_t>(v[a])) * 0x100000001b3u;
  return h;
}

void begin(Index rays, Index points, RaySamples& out) {
  out.ray_begin.reserve(at(rays + 1));
  out.ray_begin.assign(1, 0);
  for (auto* v :
       {&out.position, &out.t, &out.delta, &out.sigma, &out.density_features, &out.colour_features, &out.z})
    v->clear();
  // Reserves the maximum for these rays, so that a later call with fewer empty rays does not allocate.
  for (auto* v : {&out.t, &out.delta, &out.sigma}) v->reserve(at(rays * points));
  out.position.reserve(at(3 * rays * points));
}

float uniform(const CounterRng& rng, std::uint64_t seed, Index i) {
  return rng.uniform4(seed, static_cast<std::uint64_t>(i / 4))[at(i % 4)];
}

// Returns bounds of the points' intervals: 0, the midpoints between neighbours, the length.
float edge_before(std::span<const float> s, std::size_t i, float length) {
  if (i == 0) return 0;
  return i == s.size() ? length : 0.5f * (s[i - 1] + s[i]);
}

}  // namespace

template <class T>
void importance_points(std::span<const T> edge, std::span<const T> weight, std::span<const T> u,
                       std::span<T> out) {
  if (weight.empty() || edge.size() != weight.size() + 1)
    throw ShapeError(
        "[importance_points] edge must have one element more than weight, which has at least 1, got " +
        std::to_string(edge.size()) + " and " + std::to_string(weight.size()));
  if (out.size() != u.size())
    throw ShapeError("[importance_points] out must have the " + std::to_string(u.size()) +
                     " elements of u, got " + std::to_string(out.size()));
  const std::size_t n = weight.size();
  const double length = static_cast<double>(edge[n]) - static_cast<double>(edge[0]);
  const double per_length = length > 0 ? kFloor / length : 0;
  const auto mass = [&](std::size_t i) {
    return static_cast<double>(weight[i]) +
           per_length * (static_cast<double>(edge[i + 1]) - static_cast<double>(edge[i]));
  };
  double total = 0;
  for (std::size_t i = 0; i < n; ++i) total += mass(i);

  // Sums in double, because the remainder within an interval is a difference of two sums.
  std::size_t i = 0;
  double before = 0, here = mass(0);
  for (std::size_t j = 0; j < u.size(); ++j) {
    const double want = static_cast<double>(u[j]) * total;
    while (i + 1 < n && before + here < want) {
      before += here;
      here = mass(++i);
    }
    const double lower = static_cast<double>(edge[i]), upper = static_cast<double>(edge[i + 1]);
    const double part = here > 0 ? std::clamp((want - before) / here, 0.0, 1.0) : 0;
    out[j] = static_cast<T>(lower + part * (upper - lower));
  }
}

template void importance_points(std::span<const float>, std::span<const float>, std::span<const float>,
                                std::span<float>);
template void importance_points(std::span<const double>, std::span<const double>, std::span<const double>,
                                std::span<double>);

// Finds the occupied stretches of a ray from adjacent samples of a walk. Returns their total length.
float HierarchicalSampler::find_spans(const OccupancyGrid& grid, const float* origin, const float* direction,
                                      float step) {
  constexpr Index kMost = 16;
  const std::size_t first = spans_.size();
  const CubeSpan cube = intersect_unit_cube(origin, direction);
  RayWalk walk(origin, direction, step, 0.5f);
  float t[kMost], x[3 * kMost];
  for (Index count = kMost; count == kMost;) {
    count = walk.next(grid, kMost, t, x);
    for (Index i = 0; i < count; ++i) {
      const float begin = std::max(cube.near, t[i] - 0.5f * step),
                  end = std::min(cube.far, t[i] + 0.5f * step);
      if (spans_.size() > first && begin < spans_.back().end + 0.25f * step)
        spans_.back().end = end;
      else
        spans_.push_back({begin, end, 0});
    }
  }
  float length = 0;
  for (std::size_t k = first; k < spans_.size(); ++k) {
    spans_[k].before = length;
    length += spans_[k].end - spans_[k].begin;
  }
  return length;
}

// Appends samples of a ray at rising occupied lengths s.
void HierarchicalSampler::append(const RayBatch& rays, Index ray, std::span<const float> s,
                                 RaySamples& out) const {
  const float length = length_[at(ray)];
  std::size_t span = span_begin_[at(ray)];
  for (std::size_t i = 0; i < s.size(); ++i) {
    while (span + 1 < span_begin_[at(ray + 1)] && s[i] >= spans_[span + 1].before) ++span;
    const float t = std::min(spans_[span].begin + (s[i] - spans_[span].before), spans_[span].end);
    out.t.push_back(t);
    out.delta.push_back(edge_before(s, i + 1, length) - edge_before(s, i, length));
    for (Index a = 0; a < 3; ++a)
      out.position.push_back(rays.origins[at(3 * ray + a)] + t * rays.directions[at(3 * ray + a)]);
  }
  out.ray_begin.push_back(out.size());
}

void HierarchicalSampler::spread(const OccupancyGrid& grid, const RayBatch& rays,
                                 std::span<const float> jitter, float step, const RayPoints& points,
                                 RaySamples& out) {
  check(rays, jitter, step, points);
  points_ = points;
  jittered_ = !jitter.empty();
  spans_.clear();
  span_begin_.assign(1, 0);
  length_.clear();
  seed_.clear();
  s_.clear();
  s_.reserve(at(rays.size() * points.first()));
  spans_.reserve(at(rays.size() * kSpans));
  begin(rays.size(), points.first(), out);
  for (Index r = 0; r < rays.size(); ++r) {
    const float *origin = &rays.origins[at(3 * r)], *direction = &rays.directions[at(3 * r)];
    const float length = find_spans(grid, origin, direction, step);
    const std::uint64_t seed =
        jittered_ ? std::bit_cast<std::uint32_t>(jitter[at(r)]) : ray_seed(origin, direction);
    span_begin_.push_back(spans_.size());
    length_.push_back(length);
    seed_.push_back(seed);
    scratch_.clear();
    const auto parts = static_cast<float>(points.average);
    for (Index i = 0; i < points.average && length > 0; ++i)
      scratch_.push_back(
          length * ((static_cast<float>(i) + (jittered_ ? uniform(average_rng_, seed, i) : 0.5f)) / parts));
    for (Index i = 0; i < points.random && length > 0; ++i)
      scratch_.push_back(length * uniform(random_rng_, seed, i));
    if (points.random > 0) std::sort(scratch_.begin(), scratch_.end());
    s_.insert(s_.end(), scratch_.begin(), scratch_.end());
    append(rays, r, scratch_, out);
  }
}

void HierarchicalSampler::refine(const RayBatch& rays, const RaySamples& first,
                                 std::span<const float> weights, RaySamples& out) {
  if (first.t.size() != s_.size() || weights.size() != s_.size() || rays.size() != std::ssize(length_))
    throw ShapeError("[hierarchical_sampler] first and weights must be of the " + std::to_string(s_.size()) +
                     " samples of spread(), got " + std::to_string(first.t.size()) + " and " +
                     std::to_string(weights.size()));
  begin(rays.size(), points_.total(), out);
  const auto count = static_cast<float>(points_.importance);
  drawn_.resize(at(points_.importance));
  u_.resize(at(points_.importance));
  for (Index r = 0; r < rays.size(); ++r) {
    const auto from = at(first.ray_begin[at(r)]), n = at(first.ray_begin[at(r + 1)]) - from;
    scratch_.resize(n == 0 ? 0 : n + drawn_.size());
    if (n > 0) {
      const std::span<const float> s(s_.data() + from, n);
      edge_.clear();
      for (std::size_t i = 0; i <= n; ++i) edge_.push_back(edge_before(s, i, length_[at(r)]));
      for (Index j = 0; j < points_.importance; ++j)
        u_[at(j)] =
            (static_cast<float>(j) + (jittered_ ? uniform(importance_rng_, seed_[at(r)], j) : 0.5f)) / count;
      importance_points<float>(edge_, weights.subspan(from, n), u_, drawn_);
      std::merge(s.begin(), s.end(), drawn_.begin(), drawn_.end(), scratch_.begin());
    }
    append(rays, r, scratch_, out);
  }
}

}  // namespace fieldmark::nerf
