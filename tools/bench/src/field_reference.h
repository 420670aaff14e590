#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <memory>
#include <span>
#include <vector>

namespace fieldmark::bench {

/// Options of a FieldReference.
struct ReferenceOptions {
  Index samples = 1024;  ///< per ray, spread evenly over its path through the cube, at least 1
  /// Where matter may be. True: in the occupied cells of the field's grid, as stored in a FIELD file; false:
  /// wherever the networks give density.
  bool occupancy = true;
};

/// Renders a field without approximations, as a reference for faster renderers: rays, look-ups, networks and
/// compositing in double, the same number of samples on every ray however short its path, no early
/// termination. Samples in cells without matter count as empty. Samples that weigh less than 1e-12 get no
/// colour, which changes an image by at most 1e-12 per sample.
class FieldReference {
 public:
  /// Copies the field's current weights; the field must outlive it. @throws ValueError if options.samples <
  /// 1, or for an mlp field or a space other than a cube
  FieldReference(const nerf::RadianceField& field, const ReferenceOptions& options = {});
  ~FieldReference();
  /// @param pixels  [n] y * width + x of the requested pixels, in any order
  /// @return [n, 4] colour over the field's background, and opacity   @throws ValueError for a pixel outside
  std::vector<double> trace(const nerf::Camera& camera, std::span<const Index> pixels);
  /// Renders all pixels in order: [height * width, 4].
  std::vector<double> render(const nerf::Camera& camera);

 private:
  struct Lane;
  void trace_piece(const nerf::Camera& camera, std::span<const Index> pixels, Lane& lane, double* out) const;
  void add_ray(const nerf::Ray& ray, Lane& lane) const;
  const nerf::RadianceField& source_;
  ReferenceOptions options_;
  ParamStore<double> params_;
  nerf::Field<double> field_;
  std::vector<std::unique_ptr<Lane>> lanes_;
};

}  // namespace fieldmark::bench
