#include <fieldmark/baselines/gradcheck_cases.h>
#include "doubling_conv.h"
#include "hiding_network.h"
#include "image_noise.h"
#include "mbrs_network.h"
#include "simulated_jpeg.h"
#include "squeeze_excite.h"

#include <cmath>
#include <string>

namespace fieldmark::baselines {
namespace {

// Fixed pattern-free numbers in (-1, 1).
Tensor<double> numbers(Shape shape, double phase) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) t[i] = std::sin(phase + 1.7 * static_cast<double>(i * i + i));
  return t;
}

// Keeps every ReLU clearly open, so that differences do not cross a kink. The batch statistics of the
// normalisation keep the function nonlinear; the running ones are not parameters.
void open_relus(ParamStore<double>& store) {
  for (const auto& e : store.entries()) {
    const bool shift = e.name.ends_with("norm/beta") || e.name.ends_with("squeeze/bias");
    const bool slope = e.name.ends_with("norm/gamma") || e.name.ends_with("squeeze/weight");
    for (Index i = 0; i < e.shape.size(); ++i) {
      double& value = store.values()[static_cast<std::size_t>(e.offset + i)];
      if (shift) value = 3;
      if (slope) value *= 0.3;
    }
  }
}

GradcheckReport check_conv_block() {
  ParamStore<double> store;
  const ConvBlock<double> block(store, "b", 2, 3, 1);
  open_relus(store);
  const std::vector<Tensor<double>> in{numbers({2, 3, 3, 2}, 1)};
  return gradcheck_module(
      [&](Tape<double>&, const Params<double>& params, auto v) {
        NormPass<double> pass;
        return block(params, v[0], pass);
      },
      store, in);
}

GradcheckReport check_scale_channels() {
  const std::vector<Tensor<double>> in{numbers({2, 3, 2, 3}, 1), numbers({2, 3}, 2)};
  return gradcheck([](Tape<double>&, auto v) { return scale_channels(v[0], v[1]); }, in);
}

GradcheckReport check_squeeze_excite() {
  ParamStore<double> store;
  const SqueezeExciteBlock<double> block(store, "b", 2, 1);
  open_relus(store);
  Tensor<double> x = numbers({2, 3, 2, 2}, 1);
  for (double& v : x.data) v += 4;  // the sum after the block stays positive
  const std::vector<Tensor<double>> in{x};
  return gradcheck_module(
      [&](Tape<double>&, const Params<double>& params, auto v) {
        NormPass<double> pass;
        return block(params, v[0], pass);
      },
      store, in);
}

GradcheckReport check_depth_to_space() {
  const std::vector<Tensor<double>> in{numbers({2, 2, 3, 8}, 1)};
  return gradcheck([](Tape<double>&, auto v) { return depth_to_space(v[0]); }, in);
}

GradcheckReport check_doubling_conv() {
  ParamStore<double> store;
  const DoublingConv<double> layer(store, "d", 2, 1);
  open_relus(store);
  const std::vector<Tensor<double>> in{numbers({2, 2, 2, 2}, 1)};
  return gradcheck_module(
      [&](Tape<double>&, const Params<double>& params, auto v) {
        NormPass<double> pass;
        return layer(params, v[0], pass);
      },
      store, in);
}

GradcheckReport check_simulated_jpeg() {
  const std::vector<Tensor<double>> in{numbers({1, 8, 16, 3}, 1)};
  return gradcheck([](Tape<double>&, auto v) { return simulated_jpeg(v[0]); }, in);
}

GradcheckReport check_noise(NoiseLayer layer) {
  const std::vector<Tensor<double>> in{numbers({1, 8, 8, 3}, 1)};
  const Tensor<double> plain = numbers({1, 8, 8, 3}, 2);
  return gradcheck(
      [&](Tape<double>& tape, auto v) {
        return apply_noise_layer(layer, v[0], tape.constant(plain), CounterRng(3), 7);
      },
      in);
}

template <class Network>
GradcheckReport check_network(Index side, bool encoder, Index channels) {
  ParamStore<double> store;
  const Network net(store, {.bits = 2, .channels = channels}, 1);
  open_relus(store);
  const std::vector<Tensor<double>> in{numbers({1, side, side, 3}, 1), numbers({1, 2}, 2)};
  return gradcheck_module(
      [&](Tape<double>&, const Params<double>& params, auto v) {
        NormPass<double> pass;
        return encoder ? net.encode(params, v[0], v[1], pass) : net.decode(params, v[0], pass);
      },
      store, in);
}

GradcheckReport check_discriminator() {
  ParamStore<double> store;
  const Discriminator<double> net(store, {.channels = 2}, 1);
  open_relus(store);
  const std::vector<Tensor<double>> in{numbers({2, 3, 3, 3}, 1)};
  return gradcheck_module(
      [&](Tape<double>&, const Params<double>& params, auto v) {
        NormPass<double> pass;
        return net(params, v[0], pass);
      },
      store, in);
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  return {{"conv_block", check_conv_block},
          {"doubling_conv", check_doubling_conv},
          {"doubling_conv, depth_to_space", check_depth_to_space},
          {"hiding_network, encoder", [] { return check_network<HiddenNetwork<double>>(3, true, 2); }},
          {"hiding_network, decoder", [] { return check_network<HiddenNetwork<double>>(3, false, 2); }},
          {"hiding_network, discriminator", check_discriminator},
          {"mbrs_network, encoder", [] { return check_network<MbrsNetwork<double>>(4, true, 1); }},
          {"mbrs_network, decoder", [] { return check_network<MbrsNetwork<double>>(16, false, 1); }},
          {"image_noise, dropout", [] { return check_noise(NoiseLayer::dropout); }},
          {"image_noise, cropout", [] { return check_noise(NoiseLayer::cropout); }},
          {"image_noise, blur", [] { return check_noise(NoiseLayer::blur); }},
          {"simulated_jpeg", check_simulated_jpeg},
          {"squeeze_excite", check_squeeze_excite},
          {"squeeze_excite, scale_channels", check_scale_channels}};
}

}  // namespace fieldmark::baselines
