#include <fieldmark/core/error.h>
#include <fieldmark/imaging/pretrained_conv.h>

#include "support/expect_grad.h"
#include "support/plain_conv.h"
#include "support/random_weights.h"
#include "support/run_op.h"

using namespace fieldmark;

static constexpr PretrainedConvOptions kOptions{.in = 3, .out = 5, .kernel = 4, .stride = 3, .padding = 2};

static SafetensorsFile weights() { return random_weights(pretrained_conv_tensors("conv", kOptions)); }

TEST_CASE("pretrained_conv: values equal a plain loop over PyTorch's layout") {
  const auto file = weights();
  const auto x = uniform<float>({1, 9, 11, 3}, -1, 1, 3);
  PlainImage p = plain_image(3, 9, 11);
  for (long c = 0; c < 3; ++c)
    for (long i = 0; i < 99; ++i)
      p.x[static_cast<std::size_t>(c * 99 + i)] = static_cast<double>(x[i * 3 + c]);
  const PretrainedConv<float> conv(file, "conv", kOptions);
  Tape<float> tape;
  const auto y = conv(tape.constant(x));
  REQUIRE(y.shape() == Shape({1, 4, 4, 5}));
  CHECK(plain_error(plain_conv(p, file, "conv", 3, 2), y.value()) < 1e-6);
}

TEST_CASE("pretrained_conv: per_channel is an affine map of each channel") {
  constexpr double scale[] = {2, -1, 0.5}, shift[] = {1, 0, -3};
  const auto x = uniform<double>({1, 2, 3, 3}, -1, 1, 3);
  const auto map = PretrainedConv<double>::per_channel(scale, shift);
  const auto y = op_values([&](auto&, auto v) { return map(v[0]); }, std::vector{x});
  for (std::size_t i = 0; i < y.size(); ++i)
    CHECK(y[i] == Approx(scale[i % 3] * x.data[i] + shift[i % 3]).epsilon(1e-14));
}

TEST_CASE("pretrained_conv: gradient") {
  const auto file = weights();
  PretrainedConvOptions options = kOptions;
  options.activation = Activation::none;
  const PretrainedConv<double> conv(file, "conv", options);
  expect_grad([&](auto&, auto v) { return conv(v[0]); }, {uniform({2, 9, 11, 3}, -1, 1, 3)});
}

TEST_CASE("pretrained_conv: errors name the file, the tensor and both shapes") {
  CHECK_THROWS_WITH(
      PretrainedConv<float>(weights(), "con", kOptions),
      "[weights] random.safetensors: tensor \"con.weight\": expected F32 [5, 3, 4, 4], found none "
      "of this name");
  SafetensorsFile file;
  file.path = "f.safetensors";
  file.add("conv.weight", {5, 3, 4, 4}, std::span<const double>(Tensor<double>({240}).data));
  CHECK_THROWS_WITH(
      PretrainedConv<float>(file, "conv", kOptions),
      Contains("f.safetensors: tensor \"conv.weight\": expected F32 [5, 3, 4, 4], found F64 [5, 3, 4, 4]"));
  constexpr double two[] = {1, 2}, one[] = {1};
  CHECK_THROWS_WITH(PretrainedConv<float>::per_channel(two, one),
                    Contains("[pretrained_conv] shift: axis 0 must be 2"));
}

TEST_CASE("pretrained_conv: the same bits for any thread count") {
  const PretrainedConv<float> conv(weights(), "conv", kOptions);
  expect_same_bits([&](auto&, auto v) { return conv(v[0]); }, {uniform<float>({2, 61, 50, 3}, -1, 1, 3)});
}
