#pragma once
#include <fieldmark/engine/nn/dense.h>

#include <optional>
#include <string>
#include <vector>

namespace fieldmark::watermark {

/// Sizes of a GlobalMark.
struct GlobalMarkOptions {
  Index bits = 16;               ///< N_b, at least 1
  Index message_features = 256;  ///< N_m; 0: no D, M itself enters G
  Index colour_features = 256;   ///< N_c; 0: no E, c alone enters G
  int position_bands = 10;       ///< of gamma for positions, 1 to 20
  int direction_bands = 4;       ///< of gamma for directions, 1 to 20
  Index width = 256;             ///< units of the hidden layers of E, at least 2; G has width and width / 2
  /// As in the authors' code: E and G read c as logits with log sigma / 16, G reads them and M again before
  /// each hidden layer, and d enters G instead of E.
  bool authors_code = false;
};

/// Watermarked colour of CopyRNeRF, with one message for all places.
///   f_c = E(c, gamma(x), gamma(d)),   f_M = D(M),   c_m = sigmoid(G(f_c, f_M, c))
/// gamma(v): v and its frequency encoding. E has three hidden layers, D two layers of N_m units, G hidden
/// layers of width and width / 2 units, all with ReLU. Only N_m is from the paper; the other sizes are from
/// the authors' code. Source: Luo et al. 2023 (CopyRNeRF), section 3.2. Departures: the sigmoid keeps c_m a
/// colour, and M enters as -1 and 1, so that both values of a bit drive the network.
template <class T>
class GlobalMark {
 public:
  /// @throws ValueError if an option is out of range or a name is taken
  GlobalMark(ParamStore<T>& store, std::string_view name, const GlobalMarkOptions& options,
             std::uint64_t seed);
  /// Computes c_m.   @param x  [N, 3] unit cube   @param d  [N, 3] unit directions
  /// @param c  [N, 3] base colours; of the authors' code [N, 4], log(c / (1 - c)) and log sigma / 16
  /// @param message  [R, N_b], -1 or 1: row r is the message of samples r N / R to (r + 1) N / R - 1
  /// @return c_m [N, 3] in (0, 1)   @throws ShapeError if they do not fit, or R does not divide N
  /// Differentiable in: x, d, c, message and the parameters, except at the kinks of the ReLUs.
  Var<T> operator()(const Params<T>& params, Var<T> x, Var<T> d, Var<T> c, Var<T> message) const {
    return with_features(params, x, d, c, message).colour;
  }
  /// The network's outputs for samples.
  struct Output {
    Var<T> colour;                   ///< c_m [N, 3]
    std::optional<Var<T>> features;  ///< f_c [N, N_c]; none without E
  };
  /// As operator(), and returns the colour features, too.
  Output with_features(const Params<T>& params, Var<T> x, Var<T> d, Var<T> c, Var<T> message) const;
  /// Number of columns of c.
  Index colour_inputs() const { return options_.authors_code ? 4 : 3; }
  /// The options given to the constructor.
  const GlobalMarkOptions& options() const { return options_; }

 private:
  void register_fusion(ParamStore<T>& store, const std::string& name, std::uint64_t seed);
  Var<T> fused(const Params<T>& params, std::vector<Var<T>> inputs, Var<T> c, Var<T> message) const;

  GlobalMarkOptions options_;
  std::vector<Dense<T>> encode_, message_, fuse_;
};

}  // namespace fieldmark::watermark
