#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/nerf/sampler.h>

namespace fieldmark::nerf {

/// At how many points of a ray an mlp field is looked at. The fine network sees all, the coarse network those
/// that do not depend on it.
struct RayPoints {
  Index average = 32;     ///< one in each of as many equal parts of the ray, 0 to 1024
  Index importance = 32;  ///< drawn from the coarse network's weights, 0 to 1024
  Index random = 0;       ///< anywhere, uniformly, 0 to 1024
  /// Points of a ray in all.
  Index total() const { return average + random + importance; }
  /// Those that depend on no network.
  Index first() const { return average + random; }
};

/// Points along rays in two stages, Source: Mildenhall et al. 2020 (NeRF), sec. 5.2: first some spread over
/// the ray, then more where their weights are large.
///
/// A ray is measured by its length in occupied cells: what was ruled out takes no points. Where every cell is
/// occupied that is the part of the ray in the cube. A sample stands for the interval between the middles to
/// its neighbours (the first and the last: to the ends), which is its delta; NeRF's interval from a sample to
/// the next leaves the last one infinite, opaque at any density above zero. Positions get no gradient.
/// Reuses its buffers. One object per thread.
class HierarchicalSampler {
 public:
  /// The first points: position, t, delta and ray_begin of `out`. Where a ray meets no occupied cell it has
  /// none.
  /// @param step    to find occupied cells with, cube sides, > 0
  /// @param jitter  [R] in [0, 1): what the points of the ray are moved by at random; or empty: average
  /// points in the middles of their parts, random ones a function of the ray
  /// @throws ValueError if a count is out of range, first() is 0 or rays are contracted   @throws ShapeError
  /// if sizes do not fit
  void spread(const OccupancyGrid& grid, const RayBatch& rays, std::span<const float> jitter, float step,
              const RayPoints& points, RaySamples& out);
  /// The union of the last spread()'s points and those that their weights suggest, near to far.
  /// @param first    what spread() gave for the same rays   @param weights  of its samples, sample_weights()
  void refine(const RayBatch& rays, const RaySamples& first, std::span<const float> weights, RaySamples& out);

 private:
  struct Span {
    float begin, end;  // along the ray
    float before;      // occupied length in front of it
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
