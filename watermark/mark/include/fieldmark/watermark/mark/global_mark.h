#pragma once
#include <fieldmark/engine/nn/dense.h>

#include <string>
#include <vector>

namespace fieldmark::watermark {

/// Parts of a GlobalMark left out, as in the paper's ablation, or made as in the authors' code; all off: as
/// the paper has it.
struct MarkFusion {
  bool bare_message = false;    ///< without MFF: M itself goes to G, there is no D
  bool bare_colour = false;     ///< without CFF: c alone goes to G, there is no E
  bool late_direction = false;  ///< code: d goes to G, not to E
  bool raw_colour = false;      ///< code: E and G read four numbers before their activations, see c below
  bool repeated = false;        ///< code: M and c go into each of G's two hidden layers (once more)
  /// Equal in every part.
  friend bool operator==(const MarkFusion&, const MarkFusion&) = default;
};

/// Sizes of a GlobalMark.
struct GlobalMarkOptions {
  Index bits = 16;               ///< N_b, at least 1
  Index message_features = 256;  ///< N_m, at least 1
  Index colour_features = 256;   ///< N_c, at least 1
  int position_bands = 10;       ///< of gamma for positions, 1 to 20
  int direction_bands = 4;       ///< of gamma for directions, 1 to 20
  Index width = 256;             ///< units of the hidden layers of E, at least 2; G has width and width / 2
  MarkFusion fusion{};           ///< what goes where
};

/// The watermarked colour of CopyRNeRF as the paper has it: one message for every place.
///   f_c = E(c, gamma(x), gamma(d)),   f_M = D(M),   c_m = sigmoid(G(f_c, f_M, c))
/// Source: Luo et al. 2023 (CopyRNeRF), section 3.2. gamma: the numbers themselves and their frequency
/// encoding, 10 bands for positions, 4 for directions. The paper gives N_m = 256 and leaves the rest open; as
/// in the authors' code E has three hidden layers and N_c = 256, D two of N_m, G two of width and half of it,
/// all with ReLU. MarkFusion leaves out parts, or puts them together as that code does. Departures: the
/// sigmoid keeps c_m a colour, and M enters as -1 and 1, so that neither value of a bit is silent.
template <class T>
class GlobalMark {
 public:
  /// @throws ValueError if an option is out of range or a name is taken
  GlobalMark(ParamStore<T>& store, std::string_view name, const GlobalMarkOptions& options,
             std::uint64_t seed);
  /// @param x  [N, 3] unit cube   @param d  [N, 3] unit directions   @param c  [N, 3] colour of the base
  /// field; with raw_colour [N, 4]: log(c / (1 - c)) and a sixteenth of log sigma, each of which is a number
  /// of about 1
  /// @param message  [1, N_b], -1 or 1   @return c_m [N, 3] in (0, 1)   @throws ShapeError if they do not fit
  /// Differentiable in: x, d, c, message and the parameters; kinks of the ReLUs.
  Var<T> operator()(const Params<T>& params, Var<T> x, Var<T> d, Var<T> c, Var<T> message) const;
  /// Numbers of c: 3, or 4 with raw_colour.
  Index colour_inputs() const { return options_.fusion.raw_colour ? 4 : 3; }
  /// As constructed.
  const GlobalMarkOptions& options() const { return options_; }

 private:
  void register_fusion(ParamStore<T>& store, const std::string& name, std::uint64_t seed);
  Var<T> fused(const Params<T>& params, std::vector<Var<T>> inputs, Var<T> c, Var<T> message) const;

  GlobalMarkOptions options_;
  std::vector<Dense<T>> encode_, message_, fuse_;
};

}  // namespace fieldmark::watermark
