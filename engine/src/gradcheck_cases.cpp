#include <fieldmark/engine/dual/arithmetic.h>
#include <fieldmark/engine/dual/layout.h>
#include <fieldmark/engine/dual/loss.h>
#include <fieldmark/engine/dual/math.h>
#include <fieldmark/engine/dual/matrices.h>
#include <fieldmark/engine/dual/norm.h>
#include <fieldmark/engine/dual/reduce.h>
#include <fieldmark/engine/gradcheck_cases.h>
#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/nn/embedding.h>
#include <fieldmark/engine/nn/group_norm.h>
#include <fieldmark/engine/nn/layer_norm.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/conv_transpose2d.h>
#include <fieldmark/engine/ops/dropout.h>
#include <fieldmark/engine/ops/feature_distance.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/ops/slice.h>
#include <fieldmark/engine/ops/softmax.h>

#include <array>

#include "gradcheck_cases_parts.h"

namespace fieldmark {
namespace {

using namespace gradcheck_parts;

constexpr std::array<std::int32_t, 4> kRows{2, 0, 2, 1};
constexpr std::array<std::int32_t, 4> kLabels{2, -1, 0, 1};
constexpr std::array<double, 12> kWeights{1, 0, 0.5, 2, 0.1, 1, 3, 0, 0.2, 0.7, 1, 1};
constexpr std::array<double, 4> kRowWeights{0.5, 2, 0, 3};
constexpr std::array<double, 12> kTargets{1, 0, 0.5, 0.9, 0.1, 1, 0, 0, 0.2, 0.7, 1, 0};
constexpr std::array<double, 5> kLin{0.3, 1.1, 0.7, 1.9, 0.2};
constexpr std::array<double, 4> kMean{0.2, -0.1, 0.4, 0}, kVariance{1, 0.3, 0.5, 2};

// Biases that keep every ReLU clearly active or inactive: differences must not step over its kink.
Tensor<double> biases(Index n) {
  Tensor<double> b = mixed({n}, 3);
  for (Index i = 0; i < n; ++i) b[i] += i % 2 == 0 ? 100 : -100;
  return b;
}

// A module with its parameters; `build` makes the module in a store.
template <class Build>
Cases make_module(const char* name, const Tensor<double>& input, Build build) {
  return {{name, [=] {
             ParamStore<double> store;
             const auto module = build(store);
             return gradcheck_module([&](D&, const Params<double>& p, Vars v) { return module(p, v[0]); },
                                     store, std::span(&input, 1));
           }}};
}

Cases embedding() {
  return {{"embedding", [] {
             ParamStore<double> store;
             const Embedding<double> rows(store, "rows", {.count = 3, .width = 2}, 5);
             return gradcheck_module(
                 [&](D& tape, const Params<double>& p, Vars) { return rows(tape, p, kRows); }, store, {});
           }}};
}

Cases elementwise() {
  const auto x = off_zero({3, 4}), y = off_zero({3, 4}, 0.5);
  return join({make("arithmetic: add", [](auto&, auto v) { return add(v[0], v[1]); }, {x, y}),
               make("arithmetic: sub", [](auto&, auto v) { return sub(v[0], v[1]); }, {x, y}),
               make("arithmetic: mul", [](auto&, auto v) { return mul(v[0], v[1]); }, {x, y}),
               make("arithmetic: scale", [](auto&, auto v) { return scale(v[0], -2.5); }, {x}),
               make("activation: relu", [](auto&, auto v) { return relu(v[0]); }, {x}),
               make("activation: sigmoid", [](auto&, auto v) { return sigmoid(v[0]); }, {x}),
               make("activation: tanh", [](auto&, auto v) { return tanh(v[0]); }, {x}),
               make("activation: exp", [](auto&, auto v) { return exp(v[0]); }, {x}),
               make("activation: truncated_exp", [](auto&, auto v) { return truncated_exp(v[0]); }, {x}),
               make("activation: softplus", [](auto&, auto v) { return softplus(v[0]); }, {x}),
               make("dropout", [](D&, Vars v) { return dropout(v[0], 0.4, CounterRng(1), 2); }, {x})});
}

Cases layout() {
  const auto x = off_zero({3, 4}), y = off_zero({3, 2}, 0.5), image = off_zero({2, 4, 6, 2});
  return join(
      {make("slice: concatenate",
            [](auto&, auto v) {
              return concatenate({v[0], v[1], v[0]});
            },
            {x, y}),
       make("slice: slice", [](auto&, auto v) { return slice(v[0], 1, 2); }, {x}),
       make("rows: broadcast_rows", [](auto&, auto v) { return broadcast_rows(v[0], 5); },
            {off_zero({1, 4})}),
       make("rows: gather_rows", [](auto&, auto v) { return gather_rows(v[0], kRows); }, {x}),
       make("pool: avg_pool", [](auto&, auto v) { return avg_pool(v[0], 2); }, {off_zero({2, 3, 5, 2})}),
       make("pool: max_pool",
            [](D&, Vars v) { return max_pool(v[0], {.size = 3, .stride = 2, .ceil_mode = true}); },
            {apart({2, 4, 6, 2})}),
       make("pool: global_avg_pool", [](auto&, auto v) { return global_avg_pool(v[0]); }, {image}),
       make("resample: upsample_nearest", [](auto&, auto v) { return upsample_nearest(v[0], 2); }, {image}),
       make("resample: upsample_to", [](auto&, auto v) { return upsample_to(v[0], 7, 5); }, {image}),
       make("resample: upsample_to, nearest",
            [](auto&, auto v) { return upsample_to(v[0], 7, 5, Interpolation::nearest); }, {image}),
       make("tape: part of a value",
            [](D& tape, Vars v) {
              return mul(tape.part(v[0], 2, {3, 2}), tape.part(v[0], 6, {3, 2}));
            },
            {x}),
       make("resample: space_to_depth", [](auto&, auto v) { return space_to_depth(v[0]); }, {image})});
}

Cases losses() {
  // Differences of 0.15 to 0.37 and of -0.88 to -0.68, on either side of huber_loss's delta of 0.5.
  const auto x = off_zero({3, 4}), logits = off_zero({4, 3});
  auto y = x;
  for (Index i = 0; i < y.size(); ++i) y[i] += (i % 2 == 0 ? 0.15 : -0.9) + 0.02 * static_cast<double>(i);
  return join(
      {make("reduce: sum", [](auto&, auto v) { return sum(v[0]); }, {x}),
       make("reduce: mean", [](auto&, auto v) { return mean(v[0]); }, {x}),
       make("reduce: weighted_mean", [](auto&, auto v) { return weighted_mean<double>(v[0], kWeights); },
            {x}),
       make("loss: mse_loss", [](auto&, auto v) { return mse_loss<double>(v[0], v[1], kWeights); }, {x, y}),
       make("loss: l1_loss", [](auto&, auto v) { return l1_loss<double>(v[0], v[1], kWeights); }, {x, y}),
       make("loss: huber_loss", [](auto&, auto v) { return huber_loss<double>(v[0], v[1], 0.5, kWeights); },
            {x, y}),
       make("loss: bce_with_logits",
            [](auto&, auto v) { return bce_with_logits<double>(v[0], kTargets, kWeights); }, {x}),
       make("softmax: softmax", [](auto&, auto v) { return softmax(v[0]); }, {logits}),
       make("softmax: softmax_cross_entropy",
            [](auto&, auto v) { return softmax_cross_entropy(v[0], kLabels); }, {logits}),
       make("softmax: softmax_cross_entropy, weighted",
            [](auto&, auto v) { return softmax_cross_entropy<double>(v[0], kLabels, kRowWeights); },
            {logits})});
}

Cases norms() {
  const auto x = off_zero({2, 2, 3, 4}), gamma = off_zero({4}, 1), beta = off_zero({4}, 2);
  return join(
      {make("group_norm: x, gamma, beta",
            [](auto&, auto v) { return group_norm(v[0], v[1], v[2], {.groups = 2}); }, {x, gamma, beta}),
       make("batch_norm: x, gamma, beta", [](auto&, auto v) { return batch_norm(v[0], v[1], v[2]); },
            {x, gamma, beta}),
       make("batch_norm: fixed statistics",
            [](auto&, auto v) { return batch_norm_fixed<double>(v[0], v[1], v[2], kMean, kVariance); },
            {x, gamma, beta}),
       make("group_norm: with relu",
            [](auto&, auto v) { return group_norm(v[0], v[1], v[2], {.groups = 2, .relu = true}); },
            {x, gamma, biases(4)}),
       make("batch_norm: with relu",
            [](auto&, auto v) { return batch_norm(v[0], v[1], v[2], {.relu = true}); },
            {x, gamma, biases(4)}),
       make("batch_norm: fixed statistics, with relu",
            [](auto&, auto v) {
              return batch_norm_fixed<double>(v[0], v[1], v[2], kMean, kVariance, {.relu = true});
            },
            {x, gamma, biases(4)}),
       make_module("layer_norm: module", x, [](auto& store) { return LayerNorm<double>(store, "norm", 4); }),
       make_module("group_norm: module", x,
                   [](auto& store) { return GroupNorm<double>(store, "norm", 4, {.groups = 2}); }),
       make_module("batch_norm: module", x,
                   [](auto& store) { return BatchNorm<double>(store, "norm", 4); })});
}

Cases dense_of_parts() {
  return {{"dense layer of parts", [] {
             ParamStore<double> store;
             const Dense<double> layer(store, "layer", {.in = 5, .out = 4}, 5);
             const std::vector parts{mixed({4, 3}, 1), mixed({2, 2}, 2)};
             return gradcheck_module([&](D&, const Params<double>& p, Vars v) { return layer(p, v, 4); },
                                     store, parts);
           }}};
}

Cases products() {
  const auto product = [](Activation activation) {
    return [=](auto&, auto v) { return dense(v[0], v[1], v[2], activation); };
  };
  const auto convolution = [](Activation activation) {
    return [=](auto&, auto v) { return conv2d(v[0], v[1], v[2], activation); };
  };
  const auto rows = mixed({4, 3}, 1), matrix = mixed({3, 5}, 2), image = mixed({2, 3, 4, 2}, 1),
             window = mixed({3, 3, 2, 3}, 2);
  auto a = mixed({2, 3, 2, 5}, 1), b = mixed({2, 3, 2, 5}, 2);
  for (Tensor<double>* t : {&a, &b})
    for (double& v : t->data) v = 0.55 + 0.45 * v;
  return join(
      {make("matmul", [](auto&, auto v) { return matmul(v[0], v[1]); }, {mixed({3, 5}, 1), mixed({5, 4}, 2)}),
       make("feature_distance", [](auto&, auto v) { return feature_distance<double>(v[0], v[1], kLin); },
            {a, b}),
       make("dense", product(Activation::none), {rows, matrix, mixed({5}, 3)}),
       make("dense with relu", product(Activation::relu), {rows, matrix, biases(5)}),
       make_module("dense layer", mixed({5, 3}, 1),
                   [](auto& store) { return Dense<double>(store, "layer", {.in = 3, .out = 4}, 5); }),
       make("conv2d", convolution(Activation::none), {image, window, mixed({3}, 3)}),
       make("conv2d with relu", convolution(Activation::relu), {image, window, biases(3)}),
       make("conv2d with relu by Winograd", convolution(Activation::relu),
            {mixed({2, 5, 7, 8}, 1), mixed({3, 3, 8, 16}, 2), biases(16)}),
       make("conv2d with stride and padding",
            [](auto&, auto v) { return conv2d(v[0], v[1], v[2], {.stride = 3, .padding = 2}); },
            {mixed({2, 5, 7, 2}, 1), mixed({4, 4, 2, 3}, 2), mixed({3}, 3)}),
       make(
           "conv2d with dilation and groups",
           [](auto&, auto v) { return conv2d(v[0], v[1], v[2], {.padding = 1, .dilation = 2, .groups = 2}); },
           {mixed({1, 3, 4, 4}, 1), mixed({2, 2, 2, 4}, 2), mixed({4}, 3)}),
       make("conv_transpose2d",
            [](D&, Vars v) { return conv_transpose2d(v[0], v[1], v[2], {.stride = 2, .padding = 1}); },
            {mixed({2, 3, 4, 2}, 1), mixed({3, 3, 5, 2}, 2), mixed({5}, 3)}),
       embedding(),
       make_module("conv2d layer without a bias, with stride", mixed({1, 4, 5, 2}, 1),
                   [](auto& store) {
                     return Conv2d<double>(store, "layer", {.in = 2, .out = 3, .stride = 2, .bias = false},
                                           5);
                   }),
       make_module("conv2d layer", mixed({1, 3, 4, 2}, 1),
                   [](auto& store) { return Conv2d<double>(store, "layer", {.in = 2, .out = 3}, 5); })});
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  return join({elementwise(), layout(), losses(), norms(), products(), dense_of_parts(),
               fused_gradcheck_cases(), tensor_gradcheck_cases()});
}

}  // namespace fieldmark
