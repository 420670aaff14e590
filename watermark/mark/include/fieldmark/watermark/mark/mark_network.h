#pragma once
#include <fieldmark/engine/nn/dense.h>

namespace fieldmark::watermark {

/// Sizes of a MarkNetwork and the colours it may use.
struct MarkNetworkOptions {
  int bands = 7;  ///< of the frequency encoding of the position, 1 to 12: the finest period is 2^(2 - bands)
                  ///< cube sides
  Index features = 32;   ///< N_c, of the colour feature field, >= 1
  double tilt = 0;       ///< of the first axis, degrees, 0 (blue without luma) to 90 (grey)
  double shading = 0;    ///< h, share of the carrier that is proportional to the colour, in [0, 1]
  double red_green = 0;  ///< length of an additional red-green axis, in [0, 1] ...
  double luminance = 0;  ///< ... and of a grey one; both are off. The budget limits power, so a short axis
                         ///< is used as much as a long one
};

/// The watermarked colour c_m = c + g s(x) P(x, c) of CopyRNeRF (Luo et al. 2023, sec. 3), with a local
/// message:
///   f_c = E(c, gamma(x)),   f_M(x) = s(x) = (2 M[b] - 1) w of the cell x lies in,
///   G(f_c, f_M, c) = f_M P,   P = (1 - h + h c) tanh(g(f_c, c)) B
/// E and g are networks with one hidden ReLU layer each; the rows of B are cos(tilt) blue + sin(tilt) grey,
/// red-green and grey, where blue and red-green have no luma, and the last two are shortened. With h > 0 the
/// change resembles one of the light on a surface: dark colours change less. Departures: D is the keyed code
/// of cells instead of a network, so any message can be chosen after training and every place teaches the
/// extractor (a message fused globally stayed at 60% bit accuracy in 3,000 steps, a local one passed 90% in
/// 1,500); G is odd in f_M, so flipping a bit flips its carrier; the direction enters through c alone, which
/// makes the mark easier to bake.
template <class T>
class MarkNetwork {
 public:
  /// @throws ValueError if an option is out of range or a name is taken
  MarkNetwork(ParamStore<T>& store, std::string_view name, const MarkNetworkOptions& options,
              std::uint64_t seed);
  /// Computes P at positions. @param x [N, 3] unit cube   @param c [N, 3] colour of the base field
  /// @return [N, 3]
  /// Differentiable in: x, c and the parameters.
  Var<T> carrier(const Params<T>& params, Var<T> x, Var<T> c) const;
  /// The options given to the constructor.
  const MarkNetworkOptions& options() const { return options_; }

 private:
  MarkNetworkOptions options_;
  Dense<T> encode_0_, encode_1_, fuse_0_, fuse_1_;
};

}  // namespace fieldmark::watermark
