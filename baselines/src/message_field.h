#pragma once
#include <fieldmark/nerf/renderer.h>

#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::baselines {

/// Where a MessageField takes its message in.
enum class MessagePlace {
  inputs,  ///< "NeRF with message": beside the inputs of both networks
  density  ///< "CopyRNeRF in geometry": fused into the density alone
};

/// Sizes of a MessageField.
struct MessageFieldOptions {
  MessagePlace place = MessagePlace::inputs;  ///< which of the two systems
  Index bits = 16;                            ///< N_b, at least 1
  Index width = 256;       ///< density: units of the first hidden layer, at least 2; half as many in the next
  std::uint64_t seed = 0;  ///< of the initial numbers
};

/// A field whose densities depend on a message, as in two systems of the paper's tables; h, Theta and Y are
/// those of nerf::Field.
///   inputs:   z = Theta'_sigma(h_sigma(x), M),   sigma = exp(z_0),   c = Theta'_c(z, h_c(x), Y(d), M)
///   density:  sigma = exp(z_0 + G(z_0 / 16, M)),   c as the base field has it
/// Source: Luo et al. 2023 (CopyRNeRF), section 4.1; G as in the authors' code, two hidden layers of 256 and
/// 128 with ReLU. Departures, all so that minutes of training say something: Theta' start from the base
/// field's numbers and h stays as it is; G adds to the logarithm of the density, where theirs puts another
/// density in its place; M enters as -1 and 1, z_0 as a number of its size; where the base field is empty no
/// message puts anything. G depends on one number for each message, so that it is evaluated at 513 values of
/// z_0 from -16 to 16 and linear between.
class MessageField {
 public:
  /// Registers "mark/..." in a store and sets their initial numbers.
  /// @throws ValueError if an option is out of range, a name is taken, or place is inputs and the base field
  /// has no table
  MessageField(ParamStore<float>& store, const nerf::RadianceField& base, const MessageFieldOptions& options);

  /// The image of a camera [pixels, 3] over the base field's background, at the samples it was trained
  /// with.
  /// @param message  [1, N_b], -1 or 1   @throws ShapeError if it has another shape
  /// Gradients reach the message and the parameters.
  Var<float> image(Tape<float>& tape, const Params<float>& params, const nerf::RadianceField& base,
                   const nerf::Camera& camera, Var<float> message) const;
  /// The same [height, width, 3] in [0, 1], not recorded.
  /// @param store  with the field's numbers   @param signs  [N_b], -1 or 1   @param options  of which
  /// `finer`, `stop` and `points` are heeded
  Tensor<float> render(const ParamStore<float>& store, const nerf::RadianceField& base,
                       const nerf::Camera& camera, std::span<const std::int8_t> signs,
                       const nerf::RenderOptions& options = {}) const;
  /// The options given to the constructor.
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
