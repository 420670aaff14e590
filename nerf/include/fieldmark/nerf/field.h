#pragma once
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/nerf/hash_encoding.h>

#include <vector>

namespace fieldmark::nerf {

/// Sizes of a Field.
struct FieldOptions {
  HashEncodingOptions encoding{};  ///< of positions
  Index width = 32;                ///< units of a hidden layer, 1 to 256
  Index geometry =
      16;  ///< N_z, numbers the density network hands to the colour network; the first is log density
};

/// A radiance field on the unit cube:
///   z = Theta_sigma(h_sigma(x)),   sigma = exp(min(z_0, 15)),   c = Theta_c(z, h_c(x), Y(d))
/// h_sigma, h_c: the two parts of one hash encoding; Y: spherical harmonics; Theta: small networks with ReLU,
/// one hidden layer for density and two for colour; the colour leaves through a sigmoid. Source: Mildenhall
/// et al. 2020, sec. 3 (the split), Mueller et al. 2022, sec. 5.4 (sizes). Departure: h_c reaches only the
/// colour, so that a mark can be put into the colours without touching a byte of the geometry. The field
/// holds no numbers: they are in the store, the networks first and the table last.
template <class T>
class Field {
 public:
  /// Registers "density/0", "density/1", "colour/0" .. "colour/2" and "hash/table".
  /// @throws ValueError if an option is out of range or a name is taken
  Field(ParamStore<T>& store, const FieldOptions& options, std::uint64_t seed);

  /// What the field says about positions seen from directions.
  struct Output {
    Var<T> sigma;  ///< [N], 1 / cube side
    Var<T> rgb;    ///< [N, 3] in (0, 1)
  };
  /// @param x  [N, 3] positions in the unit cube   @param d  [N, 3] unit directions   @throws ShapeError
  /// Differentiable in: x, d and all parameters.
  Output operator()(const Params<T>& params, Var<T> x, Var<T> d) const;

  /// The pieces, for loops that look features up once for several uses.
  /// @param features  [N, F L] density part   @return z [N, N_z]
  Var<T> geometry(const Params<T>& params, Var<T> features) const;
  /// @param z  [N, N_z]   @return sigma [N]
  Var<T> density(Var<T> z) const;
  /// @param z [N, N_z]  @param features [N, F L] colour part  @param direction [N, 16] harmonics   @return
  /// rgb [N, 3]
  Var<T> colour(const Params<T>& params, Var<T> z, Var<T> features, Var<T> direction) const;

  /// As constructed.
  const FieldOptions& options() const { return options_; }
  /// The encoding whose two parts feed the networks.
  const HashEncoding<T>& encoding() const { return encoding_; }
  /// How many numbers at the front of the store belong to the networks; the table follows.
  Index network_size() const { return network_size_; }
  /// Whether a parameter (by name, other than the table) belongs to the colour side.
  static bool is_colour(std::string_view name) { return name.starts_with("colour/"); }

 private:
  FieldOptions options_;
  std::vector<Dense<T>> density_, colour_;
  Index network_size_;
  HashEncoding<T> encoding_;
};

}  // namespace fieldmark::nerf
