#pragma once
#include <fieldmark/engine/nn/dense.h>

#include <vector>

namespace fieldmark::watermark {

/// Sizes of a GlobalMark.
struct GlobalMarkOptions {
  Index bits = 16;               ///< N_b, at least 1
  Index message_features = 256;  ///< N_m, at least 1
  Index colour_features = 256;   ///< N_c, at least 1
  int position_bands = 10;       ///< of gamma for positions, 1 to 20
  int direction_bands = 4;       ///< of gamma for directions, 1 to 20
  Index width = 256;  ///< units of the hidden layers of D and E, at least 2; G has width and width / 2
};

/// The watermarked colour of CopyRNeRF as the paper has it: one message for every place.
///   f_c = E(c, gamma(x), gamma(d)),   f_M = D(M),   c_m = sigmoid(G(f_c, f_M, c))
/// Source: Luo et al. 2023 (CopyRNeRF), section 3.2. gamma: the numbers themselves and their frequency
/// encoding, 10 bands for positions, 4 for directions. The paper gives N_m = 256 and leaves the rest open; as
/// in the authors' code E has three hidden layers and N_c = 256, D two, G two of width and half of it, all
/// with ReLU. Departures: the sigmoid keeps c_m a colour, and M enters D as -1 and 1, so that neither value
/// of a bit is silent.
template <class T>
class GlobalMark {
 public:
  /// @throws ValueError if an option is out of range or a name is taken
  GlobalMark(ParamStore<T>& store, std::string_view name, const GlobalMarkOptions& options,
             std::uint64_t seed);
  /// @param x  [N, 3] unit cube   @param d  [N, 3] unit directions   @param c  [N, 3] colour of the base
  /// field
  /// @param message  [1, N_b], -1 or 1   @return c_m [N, 3] in (0, 1)   @throws ShapeError if they do not fit
  /// Differentiable in: x, d, c, message and the parameters; kinks of the ReLUs.
  Var<T> operator()(const Params<T>& params, Var<T> x, Var<T> d, Var<T> c, Var<T> message) const;
  /// As constructed.
  const GlobalMarkOptions& options() const { return options_; }

 private:
  GlobalMarkOptions options_;
  std::vector<Dense<T>> encode_, message_, fuse_;
};

}  // namespace fieldmark::watermark
