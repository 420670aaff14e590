#include <fieldmark/core/error.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/lpips.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "support/data.h"
#include "support/expect_grad.h"
#include "support/plain_conv.h"
#include "support/random_weights.h"
#include "support/run_op.h"

using namespace fieldmark;

namespace {

SafetensorsFile weights_of(LpipsNetwork network, const std::string& left_out = "none") {
  return random_weights(lpips_tensors(network), left_out);
}

PlainImage plain_input(const Tensor<float>& x, const SafetensorsFile& file) {
  const auto shift = file.f32("scaling.shift"), scale = file.f32("scaling.scale");
  PlainImage p = plain_image(3, x.shape[0], x.shape[1]);
  for (long c = 0; c < 3; ++c)
    for (long i = 0; i < p.h * p.w; ++i)
      p.x[static_cast<std::size_t>(c * p.h * p.w + i)] =
          (2 * static_cast<double>(x[i * 3 + c]) - 1 - static_cast<double>(shift[c])) /
          static_cast<double>(scale[c]);
  return p;
}

PlainImage fire(const PlainImage& x, const SafetensorsFile& f, const std::string& name) {
  const auto s = plain_conv(x, f, name + ".squeeze", 1, 0);
  return plain_concat(plain_conv(s, f, name + ".expand1x1", 1, 0),
                      plain_conv(s, f, name + ".expand3x3", 1, 1));
}

// The networks as documented for the weights.
std::vector<PlainImage> plain_features(PlainImage x, const SafetensorsFile& f, LpipsNetwork network) {
  std::vector<PlainImage> taps;
  const auto tap = [&](PlainImage y) { taps.push_back(x = std::move(y)); };
  if (network == LpipsNetwork::alex) {
    tap(plain_conv(x, f, "features.0", 4, 2));
    tap(plain_conv(plain_max_pool(x, 3, 2, false), f, "features.3", 1, 2));
    tap(plain_conv(plain_max_pool(x, 3, 2, false), f, "features.6", 1, 1));
    tap(plain_conv(x, f, "features.8", 1, 1));
    tap(plain_conv(x, f, "features.10", 1, 1));
  } else {
    tap(plain_conv(x, f, "features.0", 2, 0));
    tap(fire(fire(plain_max_pool(x, 3, 2, true), f, "features.3"), f, "features.4"));
    tap(fire(fire(plain_max_pool(x, 3, 2, true), f, "features.6"), f, "features.7"));
    tap(fire(plain_max_pool(x, 3, 2, true), f, "features.9"));
    for (const char* name : {"features.10", "features.11", "features.12"}) tap(fire(x, f, name));
  }
  return taps;
}

// sum over channels and mean over pixels of lin (f / (|f| + 1e-10) - g / (|g| + 1e-10))^2.
double plain_distance(const PlainImage& f, const PlainImage& g, const Tensor<float>& lin) {
  double sum = 0;
  for (long i = 0; i < f.h; ++i)
    for (long j = 0; j < f.w; ++j) {
      double nf = 0, ng = 0;
      for (long c = 0; c < f.c; ++c) {
        nf += f.at(c, i, j) * f.at(c, i, j);
        ng += g.at(c, i, j) * g.at(c, i, j);
      }
      for (long c = 0; c < f.c; ++c) {
        const double d = f.at(c, i, j) / (std::sqrt(nf) + 1e-10) - g.at(c, i, j) / (std::sqrt(ng) + 1e-10);
        sum += static_cast<double>(lin[c]) * d * d;
      }
    }
  return sum / static_cast<double>(f.h * f.w);
}

const char* kFiles[] = {"weights/lpips_alex_v0.1.safetensors", "weights/lpips_squeeze_v0.1.safetensors"};
const char* kNames[] = {"alex", "squeeze"};
constexpr LpipsNetwork kNetworks[] = {LpipsNetwork::alex, LpipsNetwork::squeeze};

}  // namespace

TEST_CASE("lpips: features and distances equal plain loops over the graphs, in float and in double") {
  for (const LpipsNetwork network : kNetworks) {
    const auto file = weights_of(network);
    const auto a = uniform<float>({38, 45, 3}, 0, 1, 3), b = uniform<float>({38, 45, 3}, 0, 1, 4);
    const auto want_a = plain_features(plain_input(a, file), file, network),
               want_b = plain_features(plain_input(b, file), file, network);
    const Lpips<float> lpips(file, network);
    const Lpips<double> exact(file, network);
    Tape<float> tape;
    const auto found = lpips.features(tape.constant(a.data.data(), {1, 38, 45, 3}));
    const auto d = lpips.distance(a, b), de = exact.distance(a, b);
    REQUIRE(found.size() == want_a.size());
    REQUIRE(d.per_layer.size() == want_a.size());
    double total = 0;
    for (std::size_t k = 0; k < found.size(); ++k) {
      CAPTURE(k);
      REQUIRE(found[k].shape() == Shape({1, want_a[k].h, want_a[k].w, want_a[k].c}));
      CHECK(plain_error(want_a[k], found[k].value()) < 5e-6);
      const double layer =
          plain_distance(want_a[k], want_b[k], file.f32("lin" + std::to_string(k) + ".weight"));
      total += layer;
      CHECK(std::abs(d.per_layer[k] / layer - 1) < 1e-5);
      CHECK(std::abs(de.per_layer[k] / layer - 1) < 1e-12);
    }
    CHECK(std::abs(d.value / total - 1) < 1e-5);
    CHECK(std::abs(de.value / total - 1) < 1e-12);
    CHECK(lpips.distance(a, a).value == 0);
    // Var in, Var out, a batch of two.
    Tensor<float> both({2, 38, 45, 3});
    std::copy(a.data.begin(), a.data.end(), both.data.begin());
    std::copy(b.data.begin(), b.data.end(), both.data.begin() + a.size());
    Tensor<float> swapped = both;
    std::rotate(swapped.data.begin(), swapped.data.begin() + a.size(), swapped.data.end());
    const auto y = lpips(tape.constant(both), tape.constant(swapped));
    REQUIRE(y.shape() == Shape({2}));
    CHECK(y.value()[0] == Approx(d.value).epsilon(1e-6));
    CHECK(y.value()[1] == Approx(d.value).epsilon(1e-6));
  }
}

TEST_CASE("lpips: equal to the reference values on six pairs, whole, per layer and feature by feature") {
  const auto folder = data_or_skip("lpips_reference", "LPIPS against its reference");
  if (!folder) return;
  const auto reference = nlohmann::json::parse(std::ifstream(*folder / "lpips_reference.json"));
  REQUIRE(reference["pairs"].size() == 6);
  for (int n = 0; n < 2; ++n) {
    const auto file = data_or_skip(kFiles[n], "LPIPS against its reference");
    if (!file) return;
    const Lpips<float> lpips(SafetensorsFile::read(*file), kNetworks[n]);
    for (const auto& pair : reference["pairs"]) {
      const auto& want = pair[kNames[n]];
      INFO(kNames[n] << " " << pair["name"]);
      const auto a = read_image(*folder / pair["a"].get<std::string>()),
                 b = read_image(*folder / pair["b"].get<std::string>());
      const auto d = lpips.distance(a, b);
      // Measured on each instruction set: at most 3.3e-7 whole (lego400_noise, squeeze), 7.5e-8 in a layer.
      CHECK(std::abs(d.value - want["value_f64"].get<double>()) < 1e-6);
      REQUIRE(d.per_layer.size() == want["per_layer_f32"].size());
      for (std::size_t k = 0; k < d.per_layer.size(); ++k)
        CHECK(std::abs(d.per_layer[k] - want["per_layer_f32"][k].get<double>()) < 1e-6);
      Tape<float> tape;
      const auto features = lpips.features(tape.constant(a.data.data(), {1, a.shape[0], a.shape[1], 3}));
      for (std::size_t k = 0; k < features.size(); ++k) {
        const Shape s = features[k].shape();
        CHECK(s == Shape({1, want["feature_shapes_chw"][k][1], want["feature_shapes_chw"][k][2],
                          want["feature_shapes_chw"][k][0]}));
        double sum = 0;
        for (Index i = 0; i < s.size(); ++i) sum += static_cast<double>(features[k].value()[i]);
        CHECK(sum / static_cast<double>(s.size()) ==
              Approx(want["feature_mean_a"][k].get<double>()).epsilon(1e-5));
        for (Index i = 0; i < 5; ++i) {  // the first row of channel 0
          const double first = want["feature_first5_a"][k][static_cast<std::size_t>(i)];
          CHECK(static_cast<double>(features[k].value()[i * s[3]]) ==
                Approx(first).epsilon(1e-4).margin(1e-4));
        }
      }
    }
  }
}

TEST_CASE("lpips: gradient in both images") {
  // Each colour channel of an image moves by a number. Steps are small because kinks of ReLUs and pooling
  // windows lie close together.
  for (const LpipsNetwork network : kNetworks) {
    const Lpips<double> lpips(weights_of(network), network);
    const Index side = lpips.smallest();
    const auto a = uniform({1, side, side, 3}, 0, 1, 7), b = uniform({1, side, side, 3}, 0, 1, 8);
    expect_grad(
        [&](Tape<double>& tape, auto v) {
          return lpips(add(tape.constant(a), upsample_to(v[0], side, side)),
                       add(tape.constant(b), upsample_to(v[1], side, side)));
        },
        {uniform({1, 1, 1, 3}, 0, 0.1, 5), uniform({1, 1, 1, 3}, 0, 0.1, 6)}, {.step = 1e-5});
  }
}

TEST_CASE("lpips: a missing or misshapen tensor is named with its file and both shapes") {
  for (const LpipsNetwork network : kNetworks)
    for (auto lacking = weights_of(network); !lacking.tensors.empty();) {
      // Removes tensors from the last on, so that each is the first missing one in reading order.
      const WeightTensor t = lpips_tensors(network)[lacking.tensors.size() - 1];
      lacking.tensors.pop_back();
      CHECK_THROWS_WITH(Lpips<float>(lacking, network), "[weights] random.safetensors: tensor \"" + t.name +
                                                            "\": expected F32 " + t.shape.str() +
                                                            ", found none of this name");
    }
  auto wrong = weights_of(LpipsNetwork::alex, "lin3");
  wrong.add("lin3.weight", {1, 255, 1, 1}, std::span<const float>(Tensor<float>({255}).data));
  CHECK_THROWS_WITH(
      Lpips<float>(wrong, LpipsNetwork::alex),
      "[weights] random.safetensors: tensor \"lin3.weight\": expected F32 [1, 256, 1, 1], found "
      "F32 [1, 255, 1, 1]");
  // The other network's weight file.
  CHECK_THROWS_WITH(Lpips<float>(weights_of(LpipsNetwork::squeeze), LpipsNetwork::alex),
                    Contains("\"features.0.weight\": expected F32 [64, 3, 11, 11], found F32 [64, 3, 3, 3]"));
}

TEST_CASE("lpips: images of the smallest size, and errors below it") {
  for (const LpipsNetwork network : kNetworks) {
    const Lpips<float> lpips(weights_of(network), network);
    const Index side = lpips.smallest();
    const auto a = uniform<float>({side, side, 3}, 0, 1, 1), b = uniform<float>({side, side, 3}, 0, 1, 2);
    CHECK(lpips.distance(a, b).value > 0);
    const Tensor<float> low({side - 1, 64, 3}), grey({64, 64, 1});
    CHECK_THROWS_WITH(lpips.distance(low, low),
                      "[lpips] a: height and width must be at least " + std::to_string(side) +
                          " (the network's pooling layers), got shape " + low.shape.str());
    CHECK_THROWS_WITH(lpips.distance(a, low), Contains("[lpips] b must have the shape of a"));
    CHECK_THROWS_WITH(lpips.distance(grey, grey), Contains("[lpips] a: axis 2 must be 3 (RGB)"));
    Tape<float> tape;
    CHECK_THROWS_WITH(lpips(tape.constant(a), tape.constant(b)), Contains("[lpips] a must have rank 4"));
  }
}

TEST_CASE("lpips: the same bits for any thread count, values and gradients") {
  for (const LpipsNetwork network : kNetworks) {
    const Lpips<float> lpips(weights_of(network), network);
    expect_same_bits([&](auto&, auto v) { return lpips(v[0], v[1]); },
                     {uniform<float>({2, 65, 70, 3}, 0, 1, 1), uniform<float>({2, 65, 70, 3}, 0, 1, 2)});
  }
}
