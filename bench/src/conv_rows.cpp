#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/extractor/pooled_extractor.h>

#include <algorithm>

#include "rows.h"

namespace fieldmark::bench {
namespace {

constexpr Index kPictures = 4, kSide = 128, kChannels = 64;
constexpr Index kErrorSide = 24;  // pixels, where float is compared with double

// A network of pictures; the loss is <u, y> with a fixed u.
template <class T, class Net>
struct Pass {
  Pass(Index side, Index channels) : shape{kPictures, side, side, channels} {
    x = numbers<T>(shape.size(), 3);
    for (T& v : x) v = (v + 1) / 2;
    dx.assign(x.size(), T(0));
  }
  void run() {
    tape.reset();
    std::fill(store.grads().begin(), store.grads().end(), T(0));
    std::fill(dx.begin(), dx.end(), T(0));
    const Var<T> y = net(Params<T>(store), tape.leaf(x.data(), dx.data(), shape));
    if (u.empty()) u = numbers<T>(y.shape().size(), 4);
    values.assign(y.value(), y.value() + (keep ? y.shape().size() : 0));
    tape.backward(y, u);
  }
  Shape shape;
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

// Copies the numbers of a float pass into a double one, and compares what both give.
template <template <class> class Net>
double error_of(Index channels) {
  Pass<float, Net<float>> f(kErrorSide, channels);
  Pass<double, Net<double>> d(kErrorSide, channels);
  f.keep = d.keep = true;
  std::copy(f.store.values().begin(), f.store.values().end(), d.store.values().begin());
  std::copy(f.x.begin(), f.x.end(), d.x.begin());
  f.run();
  d.u.assign(f.u.begin(), f.u.end());
  d.run();
  return std::max({relative_error(f.values, d.values), relative_error(f.dx, d.dx),
                   relative_error(f.store.grads(), d.store.grads())});
}

// Multiplications and additions of 3 x 3 convolutions over all pictures, forward, dX and dW.
double operations(Index side, Index in, Index out) {
  return 3.0 * 2.0 * static_cast<double>(kPictures * side * side) * 9.0 * static_cast<double>(in * out);
}

template <template <class> class Net>
EngineRow timed(Index channels, double per_pass, Index side, const EngineBenchOptions& o) {
  Pass<float, Net<float>> pass(side, channels);
  EngineRow row = row_of(time_calls([&] { pass.run(); }, o.runs), per_pass, static_cast<double>(kPictures));
  row.error = error_of<Net>(channels);
  return row;
}

Index scaled_side(double scale) {
  return std::max<Index>(16, static_cast<Index>(static_cast<double>(kSide) * scale));
}

}  // namespace

std::vector<RowSpec> conv_rows() {
  return {{"conv3x3_64_fb_f32", "convolution 3 x 3, 64 to 64, 4 pictures of 128 x 128",
           [](const EngineBenchOptions& o) {
             const Index side = scaled_side(o.scale);
             return timed<OneConv>(kChannels, operations(side, kChannels, kChannels), side, o);
           }},
          {"hidden_decoder_fb_f32", "decoder 3-64, 7 x 64, batch norm, ReLU, average, linear, 4 of 128 x 128",
           [](const EngineBenchOptions& o) {
             const Index side = scaled_side(o.scale);
             return timed<Decoder>(
                 3, operations(side, 3, kChannels) + 7 * operations(side, kChannels, kChannels), side, o);
           }}};
}

}  // namespace fieldmark::bench
