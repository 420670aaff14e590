#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <memory>
#include <span>
#include <vector>

namespace fieldmark::bench {

/// What a FieldReference takes as exact.
struct ReferenceOptions {
  Index samples = 1024;  ///< of every ray, spread evenly over its way through the cube, at least 1
  /// Where matter may be: true, in the cells that the field's grid calls occupied, which is what a FIELD file
  /// says; false, wherever the networks see some.
  bool occupancy = true;
};

/// Images of a field with nothing left out, to judge faster ones by: rays, look-ups, networks and composite
/// in double, the same number of samples on every ray however short its way, no early stop. Samples in cells
/// without matter count as empty; those that weigh less than 1e-12 get no colour, which changes an image by
/// at most 1e-12 a sample.
class FieldReference {
 public:
  /// Takes the field's present numbers; the field must outlive it. @throws ValueError if options.samples < 1,
  /// or for an mlp field or one of another space than a cube
  FieldReference(const nerf::RadianceField& field, const ReferenceOptions& options = {});
  ~FieldReference();
  /// @param pixels  [n] y * width + x of the pixels wanted, any order
  /// @return [n, 4] colour over the field's background, and opacity   @throws ValueError for a pixel outside
  std::vector<double> trace(const nerf::Camera& camera, std::span<const Index> pixels);
  /// All pixels in order: [height * width, 4].
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
