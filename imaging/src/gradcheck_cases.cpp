#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/gradcheck_cases.h>
#include <fieldmark/imaging/lpips.h>
#include <fieldmark/imaging/vgg16_features.h>

#include <array>
#include <cmath>
#include <span>

namespace fieldmark::imaging {
namespace {

Tensor<double> uniform(Shape shape, double low, double high, std::uint64_t stream) {
  const CounterRng rng(7, stream);
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i)
    t[i] = low + (high - low) * rng.uniform_double(static_cast<std::uint64_t>(i));
  return t;
}

// Makes a weight file with random values, large enough that signals survive the ReLUs.
SafetensorsFile random_weights(std::span<const WeightTensor> tensors) {
  SafetensorsFile file;
  for (const WeightTensor& t : tensors) {
    const bool matrix = t.shape.rank() == 4 && t.shape[1] > 0 && t.shape[0] > 1;
    const Index inputs = matrix ? t.shape.size() / t.shape[0] : 0;
    const double size = matrix ? std::sqrt(6 / static_cast<double>(inputs)) : 0.5;
    const double low = t.name.starts_with("lin") || t.name == "scaling.scale" ? size / 2 : -size;
    const auto values = uniform(t.shape, low, size, file.tensors.size());
    file.add(t.name, t.shape,
             std::span<const float>(std::vector<float>(values.data.begin(), values.data.end())));
  }
  return file;
}

// Kinks of ReLUs and pooling windows are dense in a network, so steps are small.
constexpr GradcheckOptions kSmallSteps{.step = 1e-5};

GradcheckReport check_lpips(LpipsNetwork network) {
  const Lpips<double> lpips(random_weights(lpips_tensors(network)), network);
  const Index side = lpips.smallest();
  const auto a = uniform({1, side, side, 3}, 0, 1, 93), b = uniform({1, side, side, 3}, 0, 1, 94);
  // Each input shifts every colour of an image by a constant.
  const std::vector<Tensor<double>> in{uniform({1, 1, 1, 3}, 0, 0.1, 91), uniform({1, 1, 1, 3}, 0, 0.1, 92)};
  return gradcheck(
      [&](Tape<double>& tape, auto v) {
        return lpips(add(tape.constant(a), upsample_to(v[0], side, side)),
                     add(tape.constant(b), upsample_to(v[1], side, side)));
      },
      in, kSmallSteps);
}

GradcheckReport check_vgg16() {
  const auto tensors = vgg16_tensors();
  const Vgg16Features<double> vgg(random_weights(std::span(tensors).first(6)));
  constexpr std::array<std::string_view, 2> taps{"relu1_2", "relu2_1"};
  const std::vector<Tensor<double>> in{uniform({1, 2, 1, 3}, 0, 1, 91), uniform({1, 2, 1, 3}, 0, 1, 92)};
  return gradcheck(
      [&](Tape<double>&, auto v) { return vgg.loss(upsample_to(v[0], 4, 5), upsample_to(v[1], 4, 5), taps); },
      in, kSmallSteps);
}

GradcheckReport check_pretrained_conv() {
  const PretrainedConvOptions options{
      .in = 2, .out = 3, .kernel = 3, .stride = 2, .padding = 0, .activation = Activation::none};
  const PretrainedConv<double> conv(random_weights(pretrained_conv_tensors("conv", options)), "conv",
                                    options);
  const std::vector<Tensor<double>> in{uniform({2, 5, 6, 2}, -1, 1, 91)};
  return gradcheck([&](Tape<double>&, auto v) { return conv(v[0]); }, in);
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  return {{"pretrained_conv", check_pretrained_conv},
          {"lpips: alex", [] { return check_lpips(LpipsNetwork::alex); }},
          {"lpips: squeeze", [] { return check_lpips(LpipsNetwork::squeeze); }},
          {"vgg16_features: loss", check_vgg16}};
}

}  // namespace fieldmark::imaging
