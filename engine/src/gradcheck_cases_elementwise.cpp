#include <fieldmark/engine/nn/batch_norm.h>
#include <fieldmark/engine/nn/group_norm.h>
#include <fieldmark/engine/ops/activation.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/columns.h>
#include <fieldmark/engine/ops/loss.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/reduce.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/engine/ops/rows.h>
#include <fieldmark/engine/ops/softmax.h>

#include <array>
#include <cmath>
#include <utility>

#include "gradcheck_cases_parts.h"

namespace fieldmark {
namespace {

using D = Tape<double>;
using Vars = std::span<const Var<double>>;
using Cases = std::vector<GradcheckCase>;

constexpr std::array<std::int32_t, 4> kRows{2, 0, 2, 1};
constexpr std::array<std::int32_t, 4> kLabels{2, -1, 0, 1};
constexpr std::array<double, 12> kWeights{1, 0, 0.5, 2, 0.1, 1, 3, 0, 0.2, 0.7, 1, 1};
constexpr std::array<double, 12> kTargets{1, 0, 0.5, 0.9, 0.1, 1, 0, 0, 0.2, 0.7, 1, 0};
constexpr std::array<double, 4> kMean{0.2, -0.1, 0.4, 0}, kVariance{1, 0.3, 0.5, 2};

// Spread over [-1.6, 1.6] without order; none within 0.1 of 0, where ReLU has its kink.
Tensor<double> numbers(Shape shape, double phase = 0) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) {
    const double s = std::sin(1 + phase + 2.7 * static_cast<double>(i));
    t[i] = s < 0 ? 1.5 * s - 0.1 : 1.5 * s + 0.1;
  }
  return t;
}

// All different, 0.1 apart at least.
Tensor<double> apart(Shape shape) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) t[i] = 0.1 * static_cast<double>(i * 37 % 101);
  return t;
}

GradcheckCase make(const char* name, GradcheckFn f, std::vector<Tensor<double>> inputs) {
  return {name, [f = std::move(f), inputs = std::move(inputs)] { return gradcheck(f, inputs); }};
}

// A normalisation module with its parameters; `build` makes the module in a store.
template <class Build, class Run>
GradcheckCase make_module(const char* name, Build build, Run run) {
  return {name, [=] {
            ParamStore<double> store;
            const auto module = build(store);
            const std::array inputs{numbers({2, 2, 3, 4})};
            return gradcheck_module([&](D&, const Params<double>& p, Vars v) { return run(module, p, v[0]); },
                                    store, inputs);
          }};
}

Cases elementwise() {
  const auto x = numbers({3, 4}), y = numbers({3, 4}, 0.5);
  return {make("arithmetic: add", [](D&, Vars v) { return add(v[0], v[1]); }, {x, y}),
          make("arithmetic: sub", [](D&, Vars v) { return sub(v[0], v[1]); }, {x, y}),
          make("arithmetic: mul", [](D&, Vars v) { return mul(v[0], v[1]); }, {x, y}),
          make("arithmetic: scale", [](D&, Vars v) { return scale(v[0], -2.5); }, {x}),
          make("activation: relu", [](D&, Vars v) { return relu(v[0]); }, {x}),
          make("activation: sigmoid", [](D&, Vars v) { return sigmoid(v[0]); }, {x}),
          make("activation: tanh", [](D&, Vars v) { return tanh(v[0]); }, {x}),
          make("activation: exp", [](D&, Vars v) { return exp(v[0]); }, {x}),
          make("activation: truncated_exp", [](D&, Vars v) { return truncated_exp(v[0]); }, {x}),
          make("activation: softplus", [](D&, Vars v) { return softplus(v[0]); }, {x})};
}

Cases layout() {
  const auto x = numbers({3, 4}), y = numbers({3, 2}, 0.5), image = numbers({2, 4, 6, 2});
  return {make("columns: concat_columns",
               [](D&, Vars v) {
                 return concat_columns({v[0], v[1], v[0]});
               },
               {x, y}),
          make("columns: columns", [](D&, Vars v) { return columns(v[0], 1, 2); }, {x}),
          make("rows: broadcast_rows", [](D&, Vars v) { return broadcast_rows(v[0], 5); }, {numbers({1, 4})}),
          make("rows: gather_rows", [](D&, Vars v) { return gather_rows(v[0], kRows); }, {x}),
          make("pool: avg_pool", [](D&, Vars v) { return avg_pool(v[0], 2); }, {numbers({2, 3, 5, 2})}),
          // No two numbers of a window are closer than 0.1: differences must not change the largest.
          make("pool: max_pool",
               [](D&, Vars v) { return max_pool(v[0], {.size = 3, .stride = 2, .partial = true}); },
               {apart({2, 4, 6, 2})}),
          make("pool: global_avg_pool", [](D&, Vars v) { return global_avg_pool(v[0]); }, {image}),
          make("resample: upsample_nearest", [](D&, Vars v) { return upsample_nearest(v[0], 2); }, {image}),
          make("resample: upsample_to", [](D&, Vars v) { return upsample_to(v[0], 7, 5); }, {image}),
          make("resample: space_to_depth", [](D&, Vars v) { return space_to_depth(v[0]); }, {image})};
}

Cases losses() {
  // Differences of 0.15 to 0.37 and of -0.88 to -0.68: either side of huber's delta of 0.5.
  const auto x = numbers({3, 4}), logits = numbers({4, 3});
  auto y = x;
  for (Index i = 0; i < y.size(); ++i) y[i] += (i % 2 == 0 ? 0.15 : -0.9) + 0.02 * static_cast<double>(i);
  return {
      make("reduce: sum", [](D&, Vars v) { return sum(v[0]); }, {x}),
      make("reduce: mean", [](D&, Vars v) { return mean(v[0]); }, {x}),
      make("reduce: weighted_mean", [](D&, Vars v) { return weighted_mean<double>(v[0], kWeights); }, {x}),
      make("loss: mse_loss", [](D&, Vars v) { return mse_loss<double>(v[0], v[1], kWeights); }, {x, y}),
      make("loss: huber_loss", [](D&, Vars v) { return huber_loss<double>(v[0], v[1], 0.5, kWeights); },
           {x, y}),
      make("loss: bce_with_logits",
           [](D&, Vars v) { return bce_with_logits<double>(v[0], kTargets, kWeights); }, {x}),
      make("softmax: softmax", [](D&, Vars v) { return softmax(v[0]); }, {logits}),
      make("softmax: softmax_cross_entropy", [](D&, Vars v) { return softmax_cross_entropy(v[0], kLabels); },
           {logits})};
}

Cases norms() {
  const auto x = numbers({2, 2, 3, 4}), gamma = numbers({4}, 1), beta = numbers({4}, 2);
  return {make("group_norm: x, gamma, beta",
               [](D&, Vars v) { return group_norm(v[0], v[1], v[2], {.groups = 2}); }, {x, gamma, beta}),
          make("batch_norm: x, gamma, beta", [](D&, Vars v) { return batch_norm(v[0], v[1], v[2]); },
               {x, gamma, beta}),
          make("batch_norm: fixed statistics",
               [](D&, Vars v) { return batch_norm_fixed<double>(v[0], v[1], v[2], kMean, kVariance); },
               {x, gamma, beta}),
          make_module(
              "group_norm: module",
              [](auto& store) { return GroupNorm<double>(store, "norm", 4, {.groups = 2}); },
              [](const auto& norm, const auto& p, auto v) { return norm(p, v); }),
          make_module(
              "batch_norm: module", [](auto& store) { return BatchNorm<double>(store, "norm", 4); },
              [](const auto& norm, const auto& p, auto v) { return norm(p, v); })};
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases_elementwise() {
  Cases all = elementwise();
  for (const auto& part : {layout(), losses(), norms()}) all.insert(all.end(), part.begin(), part.end());
  return all;
}

}  // namespace fieldmark
