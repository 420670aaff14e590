#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/nerf/frequency_encoding.h>
#include <fieldmark/watermark/mark/mark_network.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace fieldmark::watermark {
namespace {

MarkNetworkOptions checked(const MarkNetworkOptions& o) {
  if (o.bands < 1 || o.bands > 12)
    throw ValueError("[mark_network] bands must be 1 to 12, got " + std::to_string(o.bands));
  if (o.features < 1)
    throw ValueError("[mark_network] features must be at least 1, got " + std::to_string(o.features));
  if (!(o.tilt >= 0 && o.tilt <= 90))
    throw ValueError("[mark_network] tilt must be 0 to 90 degrees, got " + number_text(o.tilt));
  if (!(o.shading >= 0 && o.shading <= 1))
    throw ValueError("[mark_network] shading must be 0 to 1, got " + number_text(o.shading));
  if (!(o.luminance >= 0 && o.luminance <= 1 && o.red_green >= 0 && o.red_green <= 1))
    throw ValueError("[mark_network] red_green and luminance must be 0 to 1, got " +
                     number_text(o.red_green) + " and " + number_text(o.luminance));
  return o;
}

// Returns the rows of B: blue, tilted towards grey; red-green; and grey. The first has length 1, the last two
// are scaled. Blue and red-green have no luma (0.299, 0.587, 0.114: ITU-R BT.601), so blue and grey are not
// quite at right angles, and their blend is normalised.
std::array<double, 9> colour_axes(const MarkNetworkOptions& o) {
  constexpr double kRed = 0.299, kGreen = 0.587, kBlue = 0.114;
  const double yellow = kBlue / (kRed + kGreen), blue = std::hypot(1, std::sqrt(2.) * yellow),
               tilt = o.tilt * std::numbers::pi / 180, third = 1 / std::sqrt(3.);
  std::array<double, 3> first{-yellow, -yellow, 1};
  for (double& a : first) a = std::cos(tilt) * a / blue + std::sin(tilt) * third;
  const double length = std::hypot(first[0], first[1], first[2]);
  const double rg = o.red_green / std::hypot(kRed, kGreen), grey = o.luminance * third;
  return {
      first[0] / length, first[1] / length, first[2] / length, rg * kGreen, -rg * kRed, 0, grey, grey, grey};
}

}  // namespace

template <class T>
MarkNetwork<T>::MarkNetwork(ParamStore<T>& store, std::string_view name, const MarkNetworkOptions& options,
                            std::uint64_t seed)
    : options_(checked(options)),
      encode_0_(store, std::string(name) + "/encode/0",
                {.in = 6 * options.bands + 3, .out = options.features, .activation = Activation::relu},
                seed + 1),
      encode_1_(store, std::string(name) + "/encode/1",
                {.in = options.features, .out = options.features, .activation = Activation::relu}, seed + 2),
      fuse_0_(store, std::string(name) + "/fuse/0",
              {.in = options.features + 3, .out = options.features, .activation = Activation::relu},
              seed + 3),
      fuse_1_(store, std::string(name) + "/fuse/1", {.in = options.features, .out = 3}, seed + 4) {}

template <class T>
Var<T> MarkNetwork<T>::carrier(const Params<T>& params, Var<T> x, Var<T> c) const {
  Tape<T>& tape = x.tape();
  T* axes = tape.scratch(9);
  const auto table = colour_axes(options_);
  for (std::size_t i = 0; i < 9; ++i) axes[i] = static_cast<T>(table[i]);
  const Var<T> features =
      encode_1_(params, encode_0_(params, concatenate<T>({nerf::frequency_encoding(x, options_.bands), c})));
  const Var<T> fused = fuse_1_(params, fuse_0_(params, concatenate<T>({features, c})));
  const Var<T> colours = matmul(tanh(fused), tape.constant(axes, {3, 3}));
  if (options_.shading == 0) return colours;
  const Index n = c.shape().size();
  T* rest = tape.scratch(n);
  std::fill_n(rest, n, static_cast<T>(1 - options_.shading));
  return mul(colours, add(scale(c, options_.shading), tape.constant(rest, c.shape())));
}

template class MarkNetwork<float>;
template class MarkNetwork<double>;

}  // namespace fieldmark::watermark
