#pragma once
#include <fieldmark/engine/random.h>

#include "sampler.h"

namespace fieldmark::nerf {

/// Samples points from weights over intervals, by inverting the piecewise linear distribution function:
///   p(s) = (w_i + f l_i / l) / l_i / (sum w + f) in interval i of length l_i,   l = sum l_i,
///   out_j = F^-1(u_j),   F(s) = integral of p to s
/// Source: Mildenhall et al. 2020 (NeRF), sec. 5.2. The floor f, 3e-4 of an opaque ray in all, is that of its
/// code (1e-5 in each of 31 intervals), spread by length: weights of zero give uniform points.
/// @param edge    n + 1 rising bounds of the intervals   @param weight  [n], >= 0, finite
/// @param u       [m] rising, in [0, 1]   @param out [m] written, rising, within the edges
/// @throws ShapeError if sizes do not match or there is no interval
template <class T>
void importance_points(std::span<const T> edge, std::span<const T> weight, std::span<const T> u,
                       std::span<T> out);

/// Samples points along rays in two stages: first spread over the ray, then more where weights are large.
/// Source: Mildenhall et al. 2020 (NeRF), sec. 5.2.
///
/// Lengths count occupied cells only; empty cells get no points. A sample's delta is the interval between the
/// midpoints to its neighbours (for the first and last, to the ends). Departure: NeRF's interval from a
/// sample to the next leaves the last one infinite, hence opaque at any density above zero. Positions get no
/// gradient. Reuses its buffers; use one object per thread.
class HierarchicalSampler {
 public:
  /// Places the points of the first stage: writes position, t, delta and ray_begin of `out`. A ray without
  /// occupied cells gets no points.
  /// @param step    of the march that finds occupied cells, cube sides, > 0
  /// @param jitter  [R] in [0, 1): random offset of the points of each ray; or empty: average points in the
  ///                middles of their parts, random ones a function of the ray
  /// @throws ValueError if a count is out of range, first() is 0 or rays are contracted
  /// @throws ShapeError if sizes do not match
  void spread(const OccupancyGrid& grid, const RayBatch& rays, std::span<const float> jitter, float step,
              const RayPoints& points, RaySamples& out);
  /// Merges the points of the last spread() with importance points drawn by their weights, near to far.
  /// @param first    the result of spread() for the same rays   @param weights  sample_weights() of `first`
  void refine(const RayBatch& rays, const RaySamples& first, std::span<const float> weights, RaySamples& out);

 private:
  struct Span {
    float begin, end;  // along the ray
    float before;      // occupied length before it
  };
  float find_spans(const OccupancyGrid& grid, const float* origin, const float* direction, float step);
  void append(const RayBatch& rays, Index ray, std::span<const float> s, RaySamples& out) const;

  RayPoints points_;
  bool jittered_ = false;
  CounterRng average_rng_{0, 41}, random_rng_{0, 42}, importance_rng_{0, 43};
  std::vector<Span> spans_;
  std::vector<std::size_t> span_begin_;  // R + 1
  std::vector<float> length_;            // R, occupied
  std::vector<std::uint64_t> seed_;      // R
  std::vector<float> s_;                 // of the first points
  std::vector<float> scratch_, edge_, u_, drawn_;
};

}  // namespace fieldmark::nerf
