#pragma once
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/packed_weights.h>
#include <fieldmark/nerf/hash_encoding.h>
#include <fieldmark/nerf/mlp_field.h>
#include <fieldmark/nerf/spherical_harmonics.h>

#include <optional>
#include <vector>

namespace fieldmark::nerf {

/// Kinds of field: hash table and small networks, or frequency encoding and large networks.
enum class FieldKind { hash, mlp };

/// Sizes of a Field.
struct FieldOptions {
  HashEncodingOptions encoding{};  ///< of positions
  Index width = 32;                ///< units of a hidden layer, 1 to 256
  Index geometry = 16;      ///< N_z, outputs of the density network, 1 to 256; the first is log density
  bool directional = true;  ///< true if colours depend on the viewing direction
  FieldKind kind = FieldKind::hash;  ///< mlp ignores the options above
  MlpFieldOptions mlp{};             ///< of kind mlp
};

/// A radiance field on the unit cube:
///   z = Theta_sigma(h_sigma(x)),   sigma = exp(min(z_0, 15)),   c = Theta_c(z, h_c(x), Y(d))
/// Kind hash: h_sigma, h_c are the two parts of one hash encoding; Y: spherical harmonics, or nothing if the
/// field is not directional; Theta: ReLU networks with one hidden layer for density and two for colour, and a
/// sigmoid on the colour. Source: Mildenhall et al. 2020, sec. 3 (the split), Mueller et al. 2022,
/// sec. 5.4 (sizes). Departure: h_c reaches only the colour, so that colours can change without changing a
/// byte of the geometry. Kind mlp: see MlpField; h_sigma and Y are frequency encodings, h_c is empty. The
/// store holds the parameters: the networks' first, then the table.
template <class T>
class Field {
 public:
  /// Registers "density/0", "density/1", "colour/0" .. "colour/2" and "hash/table", or those of MlpField.
  /// @param prefix  prepended to the names   @throws ValueError if an option is out of range or a name is
  /// taken
  Field(ParamStore<T>& store, const FieldOptions& options, std::uint64_t seed, std::string_view prefix = "");

  /// Density and colour.
  struct Output {
    Var<T> sigma;  ///< [N], 1 / cube side
    Var<T> rgb;    ///< [N, 3] in (0, 1)
  };
  /// @param x  [N, 3] positions in the unit cube   @param d  [N, 3] unit directions   @throws ShapeError
  /// Differentiable in: x, d and all parameters.
  Output operator()(const Params<T>& params, Var<T> x, Var<T> d) const;

  /// Computes the features of n positions without recording. This and the next functions are the steps of
  /// operator(), for loops that use features several times.
  /// @param x  [n, 3]   @param density, colour  [n, density_width()] and [n, colour_width()], written
  /// @param packed  its rounded table is read if it has one; may be null
  void encode(const ParamStore<T>& store, const T* x, Index n, T* density, T* colour,
              const PackedWeights<T>* packed = nullptr) const;
  /// @param features  [N, density_width()]   @return z [N, geometry_width()]
  Var<T> geometry(const Params<T>& params, Var<T> features) const;
  /// @param z  [N, geometry_width()]   @return sigma [N]
  Var<T> density(Var<T> z) const;
  /// @param d  [N, 3] unit directions   @return Y(d) [N, direction_width()]
  Var<T> encode_directions(Var<T> d) const;
  /// @param z [N, geometry_width()]  @param features [N, colour_width()]  @param direction  see
  /// encode_directions()   @return rgb [N, 3]
  Var<T> colour(const Params<T>& params, Var<T> z, Var<T> features, Var<T> direction) const;

  /// Number of features of a position for geometry().
  Index density_width() const { return mlp_ ? mlp_->feature_width() : encoding_->width(); }
  /// Number of features of a position for colour(); 0 for mlp.
  Index colour_width() const { return mlp_ ? 0 : encoding_->width(); }
  /// N_z, elements of z.
  Index geometry_width() const { return mlp_ ? mlp_->geometry_width() : options_.geometry; }
  /// Elements of an encoded direction.
  Index direction_width() const {
    return mlp_ ? mlp_->direction_width() : options_.directional ? kSphericalHarmonics : 0;
  }

  /// The options given to the constructor.
  const FieldOptions& options() const { return options_; }
  /// True if the field has a hash table.
  bool has_table() const { return encoding_.has_value(); }
  /// Returns the encoding whose two parts feed the networks. @throws ValueError if there is no table
  const HashEncoding<T>& encoding() const;
  /// Number of network parameters. They come first in the store if the field was registered first; the table
  /// follows.
  Index network_size() const { return network_size_; }
  /// True if the named parameter (other than the table) belongs to the colour network.
  static bool is_colour(std::string_view name) { return name.starts_with("colour/"); }

 private:
  FieldOptions options_;
  std::vector<Dense<T>> density_, colour_;
  std::optional<MlpField<T>> mlp_;
  Index network_size_;
  std::optional<HashEncoding<T>> encoding_;
};

}  // namespace fieldmark::nerf
