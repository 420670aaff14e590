#pragma once
#include <fieldmark/engine/nn/dense.h>

#include <vector>

namespace fieldmark::nerf {

/// Sizes of an MlpField.
struct MlpFieldOptions {
  Index layers = 8;         ///< hidden layers of the density network, 1 to 16
  Index width = 256;        ///< units of a hidden layer, 2 to 1024; half as many before the colour
  Index skip = 5;           ///< index of the layer that reads the encoded position again; 0: none
  int position_bands = 10;  ///< of the frequency encoding of positions, 1 to 20
  int direction_bands = 4;  ///< of the frequency encoding of directions, 1 to 20
};

/// Numbers of samples along a ray of an mlp field. The fine network evaluates all of them, the coarse network
/// those of first().
struct RayPoints {
  Index average = 32;     ///< one in each of this many equal parts of the ray, 0 to 1024
  Index importance = 32;  ///< drawn from the coarse network's weights, 0 to 1024
  Index random = 0;       ///< uniform along the ray, 0 to 1024
  /// Number of all samples of a ray.
  Index total() const { return average + random + importance; }
  /// Number of samples that depend on no network.
  Index first() const { return average + random; }
};

/// The networks of the original radiance field:
///   gamma_B(p) = (p, sin(2^0 pi p), cos(2^0 pi p), ..., sin(2^(B-1) pi p), cos(2^(B-1) pi p))
///   h = relu layers of gamma(2 x - 1), one of which reads it again,   z = (w h + b, h),
///   c = sigmoid(linear(relu layer(linear(h), gamma(d))))
/// Source: Mildenhall et al. 2020 (NeRF), sec. 5.1 and fig. 7; gamma with the position itself, as in its
/// code, whose eight-layer network is the default here. Departures: the cube spans [-1, 1] (the paper's
/// normalised coordinates; its code leaves pi out and world units in); z_0 is the log density, see Field.
template <class T>
class MlpField {
 public:
  /// Registers "<prefix>density/0" .. (the last has one output: z_0) and "<prefix>colour/0" .. "colour/2".
  /// @throws ValueError if an option is out of range or a name is taken
  MlpField(ParamStore<T>& store, std::string_view prefix, const MlpFieldOptions& options, std::uint64_t seed);

  /// Encodes positions, as an op. @param x [N, 3] in the unit cube   @return [N, feature_width()]
  /// Differentiable in: x.
  Var<T> encode(Var<T> x) const;
  /// Computes the same values without recording. @param x [n, 3]   @param features [n, feature_width()],
  /// written
  void encode(const T* x, Index n, T* features) const;
  /// Encodes directions. @param d [N, 3]   @return [N, direction_width()]   Differentiable in: d.
  Var<T> encode_directions(Var<T> d) const;
  /// @param features [N, feature_width()]   @return z [N, geometry_width()]
  Var<T> geometry(const Params<T>& params, Var<T> features) const;
  /// @param z [N, geometry_width()]  @param direction [N, direction_width()]   @return rgb [N, 3] in (0, 1)
  Var<T> colour(const Params<T>& params, Var<T> z, Var<T> direction) const;

  Index feature_width() const { return 3 + 6 * options_.position_bands; }     ///< of an encoded position
  Index direction_width() const { return 3 + 6 * options_.direction_bands; }  ///< of an encoded direction
  Index geometry_width() const {
    return 1 + options_.width;
  }  ///< of z: log density and the last hidden layer

 private:
  MlpFieldOptions options_;
  std::vector<Dense<T>> density_, colour_;
};

}  // namespace fieldmark::nerf
