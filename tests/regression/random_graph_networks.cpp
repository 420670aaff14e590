#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/ops/conv_transpose2d.h>
#include <fieldmark/engine/ops/dropout.h>
#include <fieldmark/engine/ops/feature_distance.h>
#include <fieldmark/engine/ops/fused.h>
#include <fieldmark/engine/ops/group_norm.h>
#include <fieldmark/engine/ops/layer_norm.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/ops/pool.h>
#include <fieldmark/engine/ops/relu_family.h>
#include <fieldmark/engine/ops/resample.h>

#include "regression/random_graph.h"

// The ops of networks and images.
using fieldmark::Activation;
using fieldmark::Index;

template <class T>
void RandomGraph<T>::add_networks(Table& t) {
  t["matmul"] = [](RandomGraph& g) {
    const std::size_t a = g.rows(), b = g.input({g.vars_[a].shape()[1], 3});
    g.emit("matmul", {a, b}, {}, matmul(g.vars_[a], g.vars_[b]));
  };
  t["dense"] = [](RandomGraph& g) {
    const std::size_t x = g.rows(), w = g.input({g.vars_[x].shape()[1], 5}), b = g.input({5});
    const bool relu = g.below(2) == 0;
    g.emit("dense", {x, w, b}, {{"relu", relu}},
           dense(g.vars_[x], g.vars_[w], g.vars_[b], relu ? Activation::relu : Activation::none));
  };
  t["dropout"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    const fieldmark::CounterRng rng(g.seed_, 1);
    std::vector<int> kept;  // by the rule of dropout.h
    for (Index i = 0; i < g.vars_[x].shape().size(); ++i)
      kept.push_back(rng.bits(7, static_cast<std::uint64_t>(i / 4))[fieldmark::at(i % 4)] >= 0x4000'0000U);
    g.emit("dropout", {x}, {{"p", 0.25}, {"kept", kept}}, dropout(g.vars_[x], 0.25, rng, 7));
  };
  t["leaky_relu"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    g.emit("leaky_relu", {x}, {{"slope", 0.2}}, leaky_relu(g.vars_[x], 0.2));
  };
  t["elu"] = [](RandomGraph& g) {
    const std::size_t x = g.any();
    g.emit("elu", {x}, {{"alpha", 0.7}}, elu(g.vars_[x], 0.7));
  };
  // Every step that a chain can have.
  t["fused"] = [](RandomGraph& g) {
    const auto chain = [](auto x, auto a, auto b) {
      const auto root = sqrt(square(x - a) + 0.5) * sigmoid(minimum(x, a));
      const auto pole = reciprocal(square(b) + 1.0) + 0.5 / (1.0 + exp(-abs(x)));
      return tanh(x * a + b) / root + relu(maximum(x, b)) - log(softplus(b) + 1.0) * pole +
             affine(a, 0.3, 0.1) / 2.0;
    };
    const std::size_t x = g.any(), a = g.partner(x), b = g.partner(x);
    g.emit("fused", {x, a, b}, {}, fieldmark::fused(chain, g.vars_[x], g.vars_[a], g.vars_[b]));
  };
}

template <class T>
void RandomGraph<T>::add_images(Table& t) {
  // Stride 1 and the same size: a few channels, or as many as Winograd's method takes.
  const auto same = [&t](const std::string& name, Index channels, Index outputs) {
    t[name] = [=](RandomGraph& g) {
      const std::size_t x = g.images(channels), w = g.input({3, 3, channels, outputs}, -0.5, 0.5);
      const std::size_t b = g.input({outputs});
      const bool relu = g.below(2) == 0;
      g.emit(name, {x, w, b}, {{"relu", relu}, {"padding", 1}},
             conv2d(g.vars_[x], g.vars_[w], g.vars_[b], relu ? Activation::relu : Activation::none));
    };
  };
  same("conv2d", 4, 4);
  same("conv2d_few", 4, 1);
  same("conv2d_wide", 16, 8);
  t["conv2d_window"] = [](RandomGraph& g) {
    const auto draw = [&g](Index n) { return static_cast<Index>(g.below(static_cast<std::size_t>(n))); };
    const Index k = 1 + draw(3), groups = Index{1} << draw(3), stride = 1 + draw(2);
    const Index dilation = k == 3 ? 1 : 1 + draw(2), padding = draw(2);
    const std::size_t x = g.images(), w = g.input({k, k, 4 / groups, 4}), b = g.input({4});
    const bool relu = g.below(2) == 0;
    g.emit("conv2d_window", {x, w, b},
           {{"relu", relu},
            {"stride", stride},
            {"padding", padding},
            {"dilation", dilation},
            {"groups", groups}},
           conv2d(g.vars_[x], g.vars_[w], g.vars_[b], {stride, padding, dilation, groups},
                  relu ? Activation::relu : Activation::none));
  };
  t["conv_transpose2d"] = [](RandomGraph& g) {
    const std::size_t x = g.images(), w = g.input({3, 3, 2, 4}, -0.5, 0.5), b = g.input({2});
    const Index stride = 1 + static_cast<Index>(g.below(2)), padding = static_cast<Index>(g.below(2));
    g.emit("conv_transpose2d", {x, w, b}, {{"stride", stride}, {"padding", padding}},
           conv_transpose2d(g.vars_[x], g.vars_[w], g.vars_[b], {.stride = stride, .padding = padding}));
  };
  const auto one = [&t](const std::string& name, const Json& args, auto f) {
    t[name] = [=](RandomGraph& g) {
      const std::size_t x = g.images();
      g.emit(name, {x}, args, f(g.vars_[x]));
    };
  };
  one("avg_pool", {{"size", 2}}, [](V x) { return avg_pool(x, 2); });
  one("global_avg_pool", {}, [](V x) { return global_avg_pool(x); });
  one("max_pool", {{"size", 3}, {"stride", 2}, {"ceil", true}},
      [](V x) { return max_pool(x, {.size = 3, .stride = 2, .ceil_mode = true}); });
  one("upsample_nearest", {{"factor", 2}}, [](V x) { return upsample_nearest(x, 2); });
  one("upsample_to", {{"size", {7, 3}}, {"mode", "bilinear"}}, [](V x) { return upsample_to(x, 7, 3); });
  one("upsample_to_nearest", {{"size", {7, 3}}, {"mode", "nearest-exact"}},
      [](V x) { return upsample_to(x, 7, 3, fieldmark::Interpolation::nearest); });
}

template <class T>
void RandomGraph<T>::add_norms(Table& t) {
  const auto norm = [&t](const std::string& name, auto f) {
    t[name] = [=](RandomGraph& g) {
      const std::size_t x = g.images(), gamma = g.input({4}), beta = g.input({4});
      const bool relu = g.below(2) == 0;
      const auto mean = g.numbers(4, -1, 1), variance = g.numbers(4, 0.5, 2);
      g.weighed(g.emit(name, {x, gamma, beta},
                       {{"relu", relu}, {"mean", list_of(mean)}, {"variance", list_of(variance)}},
                       f(g.vars_[x], g.vars_[gamma], g.vars_[beta], relu, mean, variance)));
    };
  };
  norm("batch_norm", [](V x, V gamma, V beta, bool relu, auto, auto) {
    return batch_norm(x, gamma, beta, {.relu = relu});
  });
  norm("batch_norm_fixed", [](V x, V gamma, V beta, bool relu, auto mean, auto variance) {
    return batch_norm_fixed(x, gamma, beta, mean, variance, {.relu = relu});
  });
  norm("group_norm", [](V x, V gamma, V beta, bool relu, auto, auto) {
    return group_norm(x, gamma, beta, {.groups = 2, .relu = relu});
  });
  t["layer_norm"] = [](RandomGraph& g) {
    const std::size_t x = g.any(1);
    const Index n = g.vars_[x].shape()[-1];
    const std::size_t noise = g.input(g.vars_[x].shape());  // a constant row is ill-conditioned
    const std::size_t y = g.emit("add", {x, noise}, {}, g.vars_[x] + g.vars_[noise]);
    const std::size_t gamma = g.input({n}), beta = g.input({n});
    g.weighed(
        g.emit("layer_norm", {y, gamma, beta}, {}, layer_norm(g.vars_[y], g.vars_[gamma], g.vars_[beta])));
  };
  t["space_to_depth"] = [](RandomGraph& g) {
    const std::size_t x = g.images();
    const fieldmark::Shape s = g.vars_[x].shape();
    const std::size_t even =
        g.emit("upsample_nearest", {x}, {{"factor", 2}}, upsample_nearest(g.vars_[x], 2));
    const std::size_t noise = g.input({1, 2 * s[1], 2 * s[2], 1});
    const std::size_t y = g.emit("mul", {even, noise}, {}, g.vars_[even] * g.vars_[noise]);
    g.emit("space_to_depth", {y}, {}, space_to_depth(g.vars_[y]));
  };
  t["feature_distance"] = [](RandomGraph& g) {
    const std::size_t a = g.images(), b = g.input(g.vars_[a].shape());
    const auto w = g.numbers(4, 0, 1);
    g.emit("feature_distance", {a, b}, {{"weights", list_of(w)}},
           feature_distance(g.vars_[a], g.vars_[b], w));
  };
}

template void RandomGraph<float>::add_networks(Table&);
template void RandomGraph<double>::add_networks(Table&);
template void RandomGraph<float>::add_images(Table&);
template void RandomGraph<double>::add_images(Table&);
template void RandomGraph<float>::add_norms(Table&);
template void RandomGraph<double>::add_norms(Table&);
