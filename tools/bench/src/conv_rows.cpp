#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/extractor/pooled_extractor.h>

#include <algorithm>
#include <array>

#include "peer_work.h"
#include "rows.h"

namespace fieldmark::bench {
namespace {

constexpr Index kImages = 4, kSide = 128, kChannels = 64;
constexpr int kErrorImages = 5;  // sets of images on which float is compared with double
constexpr Index kDrawSide = 16;  // pixels, for comparing gradients with a peer

// An image network; the loss is <u, y> with a fixed u.
template <class T, class Net>
struct Pass {
  Pass(Index side, Index channels, std::uint64_t seed_ = 3)
      : shape{kImages, side, side, channels}, seed(seed_) {
    x = numbers<T>(shape.size(), seed);
    for (T& v : x) v = (v + 1) / 2;
    dx.assign(x.size(), T(0));
  }
  void run() {
    tape.reset();
    std::fill(store.grads().begin(), store.grads().end(), T(0));
    std::fill(dx.begin(), dx.end(), T(0));
    const Var<T> y = net(Params<T>(store), tape.leaf(x.data(), dx.data(), shape));
    if (u.empty()) u = numbers<T>(y.shape().size(), seed + 1);
    y_shape = y.shape();
    values.assign(y.value(), y.value() + (keep ? y.shape().size() : 0));
    tape.backward(y, u);
  }
  Shape shape, y_shape;
  std::uint64_t seed;
  ParamStore<T> store;
  Net net = Net::make(store);
  Tape<T> tape;
  std::vector<T> x, u, dx, values;
  bool keep = false;
};

template <class T>
struct OneConv {
  static OneConv make(ParamStore<T>& store) {
    return {Conv2d<T>(store, "conv", {.in = kChannels, .out = kChannels}, 1)};
  }
  Var<T> operator()(const Params<T>& params, Var<T> x) const { return conv(params, x); }
  Conv2d<T> conv;
};

template <class T>
struct Decoder {
  static Decoder make(ParamStore<T>& store) {
    return {extractor::PooledExtractor<T>(store, "h",
                                          {.n_bits = kChannels, .channels = kChannels, .layers = 8}, 1)};
  }
  Var<T> operator()(const Params<T>& params, Var<T> x) const { return h(params, x); }
  extractor::PooledExtractor<T> h;
};

// Copies the numbers of a float pass to a double pass, and compares their results.
template <template <class> class Net>
double error_of(Index side, Index channels, std::uint64_t seed) {
  Pass<float, Net<float>> f(side, channels, seed);
  Pass<double, Net<double>> d(side, channels, seed);
  f.keep = d.keep = true;
  std::copy(f.store.values().begin(), f.store.values().end(), d.store.values().begin());
  std::copy(f.x.begin(), f.x.end(), d.x.begin());
  f.run();
  d.u.assign(f.u.begin(), f.u.end());
  d.run();
  return std::max({relative_error(f.values, d.values), relative_error(f.dx, d.dx),
                   relative_error(f.store.grads(), d.store.grads())});
}

// Returns the worst error over several sets of images for a single convolution, and the median for the
// decoder. Where one ReLU argument in a million has different signs in float and double, gradients differ by
// 1e-3 to 1e-2 however small the rounding; at 12 x 12 pixels that affects one set of images in 16.
template <template <class> class Net>
double typical_error(Index side, Index channels) {
  constexpr int which = std::is_same_v<Net<float>, OneConv<float>> ? kErrorImages - 1 : kErrorImages / 2;
  std::array<double, kErrorImages> errors{};
  for (std::size_t k = 0; k < errors.size(); ++k) errors[k] = error_of<Net>(side, channels, 3 + 2 * k);
  std::nth_element(errors.begin(), errors.begin() + which, errors.end());
  return errors[which];
}

// Counts multiplications and additions of 3 x 3 convolutions over all images: forward, dX and dW.
double operations(Index side, Index in, Index out) {
  return 3.0 * 2.0 * static_cast<double>(kImages * side * side) * 9.0 * static_cast<double>(in * out);
}

template <template <class> class Net>
EngineRow timed(Index channels, double per_pass, Index side, Index error_side, const RowOptions& o) {
  Pass<float, Net<float>> pass(side, channels);
  EngineRow row =
      row_of(time_calls([&] { pass.run(); }, o.runs, 0.1, o.between), per_pass, static_cast<double>(kImages));
  row.error = typical_error<Net>(error_side, channels);
  return row;
}

template <class Net>
PeerPass finished(Pass<float, Net>& pass) {
  pass.keep = true;
  pass.run();
  return {pass.shape, pass.y_shape, pass.x, pass.u, pass.values, pass.dx};
}

// One pass of timed() for a peer to repeat, and `draws` on small images.
template <template <class> class Net>
SafetensorsFile work(const char* network, Index channels, Index side, std::uint64_t draws) {
  Pass<float, Net<float>> pass(side, channels);
  SafetensorsFile file = peer_work(network, pass.store, finished(pass));
  for (std::uint64_t d = 0; d < draws; ++d) {
    Pass<float, Net<float>> small(kDrawSide, channels, 100 + d);
    add_draw(file, small.store, finished(small));
  }
  return file;
}

Index scaled_side(double scale) {
  return std::max<Index>(16, static_cast<Index>(static_cast<double>(kSide) * scale));
}

}  // namespace

std::vector<RowSpec> conv_rows() {
  return {{"conv3x3_64_fb_f32", "convolution 3 x 3, 64 to 64, 4 images of 128 x 128",
           [](const RowOptions& o) {
             const Index side = scaled_side(o.scale);
             return timed<OneConv>(kChannels, operations(side, kChannels, kChannels), side, 24, o);
           },
           [](const RowOptions& o) { return work<OneConv>("conv", kChannels, scaled_side(o.scale), 0); }},
          {"hidden_decoder_fb_f32", "decoder 3-64, 7 x 64, batch norm, ReLU, average, linear, 4 of 128 x 128",
           [](const RowOptions& o) {
             const Index side = scaled_side(o.scale);
             return timed<Decoder>(
                 3, operations(side, 3, kChannels) + 7 * operations(side, kChannels, kChannels), side, 12, o);
           },
           [](const RowOptions& o) { return work<Decoder>("decoder", 3, scaled_side(o.scale), 4); }}};
}

}  // namespace fieldmark::bench
