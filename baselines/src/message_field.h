#pragma once
#include <fieldmark/nerf/renderer.h>

#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::baselines {

/// Where a MessageField receives its message.
enum class MessagePlace {
  inputs,  ///< "NeRF with message": concatenated with the inputs of both networks
  density  ///< "CopyRNeRF in geometry": fused into the density alone
};

/// Options of a MessageField.
struct MessageFieldOptions {
  MessagePlace place = MessagePlace::inputs;  ///< which of the two systems
  Index bits = 16;                            ///< N_b, at least 1
  Index width = 256;       ///< density: units of the first hidden layer, at least 2; the second has half
  std::uint64_t seed = 0;  ///< seed of the initial weights
};

/// A field whose densities depend on a message, as in two systems of the paper's tables; h, Theta and Y are
/// those of nerf::Field.
///   inputs:   z = Theta'_sigma(h_sigma(x), M),   sigma = exp(z_0),   c = Theta'_c(z, h_c(x), Y(d), M)
///   density:  sigma = exp(z_0 + G(z_0 / 16, M)),   c as in the base field
/// Source: Luo et al. 2023 (CopyRNeRF), section 4.1; G as in the authors' code, two hidden layers of 256 and
/// 128 with ReLU. Departures, so that minutes of training are informative: Theta' start from the base field's
/// weights and h is unchanged; G adds to the logarithm of the density, where theirs replaces the density; M
/// enters as -1 and 1, and z_0 scaled to that size; no message adds density where the base field is empty.
/// For a message, G depends on one number only, so it is evaluated at 513 values of z_0 from -16 to 16 and
/// interpolated linearly.
class MessageField {
 public:
  /// Registers "mark/..." in a store and initialises the weights.
  /// @throws ValueError if an option is out of range, a name is taken, or place is inputs and the base field
  /// has no table
  MessageField(ParamStore<float>& store, const nerf::RadianceField& base, const MessageFieldOptions& options);

  /// Renders a camera's image [pixels, 3] over the base field's background, with the samples of its training.
  /// @param message  [1, N_b], -1 or 1   @throws ShapeError if it has another shape
  /// Gradients reach the message and the parameters.
  Var<float> image(Tape<float>& tape, const Params<float>& params, const nerf::RadianceField& base,
                   const nerf::Camera& camera, Var<float> message) const;
  /// Renders the same image [height, width, 3] in [0, 1] without recording it.
  /// @param store  holds the field's weights   @param signs  [N_b], -1 or 1   @param options  only `finer`,
  /// `stop` and `points` are used
  Tensor<float> render(const ParamStore<float>& store, const nerf::RadianceField& base,
                       const nerf::Camera& camera, std::span<const std::int8_t> signs,
                       const nerf::RenderOptions& options = {}) const;
  /// Returns the options given to the constructor.
  const MessageFieldOptions& options() const { return options_; }

 private:
  struct Rays;
  Rays march(Tape<float>& tape, const nerf::RadianceField& base, const nerf::Camera& camera, Index begin,
             Index end, const nerf::RenderOptions& options) const;
  Var<float> changed(const Params<float>& params, Var<float> z_0, Var<float> message) const;
  Var<float> pixels(Tape<float>& tape, const Params<float>& params, const nerf::RadianceField& base,
                    const nerf::Camera& camera, Index begin, Index end, const nerf::RenderOptions& options,
                    Var<float> message) const;

  MessageFieldOptions options_;
  std::vector<Dense<float>> density_, colour_;
};

}  // namespace fieldmark::baselines
