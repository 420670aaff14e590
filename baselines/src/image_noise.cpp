#include "image_noise.h"
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/conv2d.h>
#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/imaging/image.h>
#include "simulated_jpeg.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace fieldmark::baselines {
namespace {

constexpr std::array kHidden{NoiseLayer::identity, NoiseLayer::dropout, NoiseLayer::cropout, NoiseLayer::blur,
                             NoiseLayer::simulated_jpeg};
constexpr std::array kMbrs{NoiseLayer::identity, NoiseLayer::simulated_jpeg, NoiseLayer::real_jpeg};
constexpr Index kBlurSide = 7;
constexpr int kQuality = 50;

// mask marked + (1 - mask) plain
template <class T>
Var<T> mixed(Var<T> marked, Var<T> plain, const T* mask) {
  const Var<T> m = marked.tape().constant(mask, marked.shape());
  return add(plain, mul(m, sub(marked, plain)));
}

template <class T>
Var<T> dropout(Var<T> marked, Var<T> plain, const CounterRng& rng, std::uint64_t step) {
  const float share = 0.3f * rng.uniform(step, 1);
  const Index pixels = marked.shape().size() / 3;
  T* mask = marked.tape().scratch(3 * pixels);
  for (Index p = 0; p < pixels; ++p)
    std::fill_n(mask + 3 * p, 3,
                rng.uniform(step, 100 + static_cast<std::uint64_t>(p)) < share ? T(0) : T(1));
  return mixed(marked, plain, mask);
}

template <class T>
Var<T> cropout(Var<T> marked, Var<T> plain, const CounterRng& rng, std::uint64_t step) {
  const Shape s = marked.shape();
  const double side = std::sqrt(0.3 + 0.7 * static_cast<double>(rng.uniform(step, 1)));
  const auto extent = [&](Index of) {
    return std::max<Index>(1, std::lround(side * static_cast<double>(of)));
  };
  const Index h = extent(s[1]), w = extent(s[2]);
  const Index top = rng.below(s[1] - h + 1, step, 2), left = rng.below(s[2] - w + 1, step, 3);
  T* mask = marked.tape().scratch(s.size());
  std::fill_n(mask, s.size(), T(0));
  for (Index r = 0; r < s[0] * s[1]; ++r)
    if (const Index y = r % s[1]; y >= top && y < top + h)
      std::fill_n(mask + (r * s[2] + left) * 3, 3 * w, T(1));
  return mixed(marked, plain, mask);
}

template <class T>
Var<T> blurred(Var<T> marked, const CounterRng& rng, std::uint64_t step) {
  const double sigma = 0.2 + static_cast<double>(rng.uniform(step, 1));
  std::array<double, kBlurSide> row{};
  double sum = 0;
  for (Index i = 0; i < kBlurSide; ++i) {
    constexpr Index kMiddle = kBlurSide / 2;
    const auto x = static_cast<double>(i - kMiddle);
    sum += row[static_cast<std::size_t>(i)] = std::exp(-x * x / (2 * sigma * sigma));
  }
  Tape<T>& tape = marked.tape();
  T* w = tape.scratch(kBlurSide * kBlurSide * 9);
  std::fill_n(w, kBlurSide * kBlurSide * 9, T(0));
  for (Index i = 0; i < kBlurSide; ++i)
    for (Index j = 0; j < kBlurSide; ++j)
      for (Index c = 0; c < 3; ++c)
        w[((i * kBlurSide + j) * 3 + c) * 3 + c] =
            static_cast<T>(row[static_cast<std::size_t>(i)] * row[static_cast<std::size_t>(j)] / (sum * sum));
  T* bias = tape.scratch(3);
  std::fill_n(bias, 3, T(0));
  return conv2d(marked, tape.constant(w, {kBlurSide, kBlurSide, 3, 3}), tape.constant(bias, {3}));
}

template <class T>
Var<T> through_file(Var<T> marked) {
  const Shape s = marked.shape();
  const Index each = s[1] * s[2] * 3;
  T* y = marked.tape().scratch(s.size());
  Tensor<float> view_image({s[1], s[2], 3});
  for (Index n = 0; n < s[0]; ++n) {
    for (Index i = 0; i < each; ++i)
      view_image[i] = static_cast<float>(std::clamp(marked.value()[n * each + i] / 2 + T(0.5), T(0), T(1)));
    const Tensor<float> back = jpeg_round_trip(view_image, kQuality);
    for (Index i = 0; i < each; ++i) y[n * each + i] = static_cast<T>(2 * back[i] - 1);
  }
  return marked.tape().constant(y, s);
}

}  // namespace

std::span<const NoiseLayer> hidden_noise_layers() { return kHidden; }
std::span<const NoiseLayer> mbrs_noise_layers() { return kMbrs; }

template <class T>
Var<T> apply_noise_layer(NoiseLayer layer, Var<T> marked, Var<T> plain, const CounterRng& rng,
                         std::uint64_t step) {
  check_rank("noise_layer", "marked", marked.shape(), 4, "[images, height, width, 3]");
  check_extent("noise_layer", "marked", marked.shape(), 3, 3, "red, green, blue");
  check_same("noise_layer", "marked", marked.shape(), "plain", plain.shape());
  switch (layer) {
    case NoiseLayer::dropout:
      return dropout(marked, plain, rng, step);
    case NoiseLayer::cropout:
      return cropout(marked, plain, rng, step);
    case NoiseLayer::blur:
      return blurred(marked, rng, step);
    case NoiseLayer::simulated_jpeg:
      return simulated_jpeg(marked);
    case NoiseLayer::real_jpeg:
      return through_file(marked);
    case NoiseLayer::identity:
      break;
  }
  return marked;
}

template Var<float> apply_noise_layer(NoiseLayer, Var<float>, Var<float>, const CounterRng&, std::uint64_t);
template Var<double> apply_noise_layer(NoiseLayer, Var<double>, Var<double>, const CounterRng&,
                                       std::uint64_t);

}  // namespace fieldmark::baselines
