#include <fieldmark/engine/nn/conv2d.h>
#include <fieldmark/engine/nn/dense.h>
#include <fieldmark/engine/ops/feature_distance.h>
#include <fieldmark/engine/ops/matmul.h>

#include <cmath>

#include "gradcheck_cases_parts.h"

namespace fieldmark {
namespace {

// Fixed numbers in (-1, 1) without a pattern.
Tensor<double> numbers(Shape shape, double phase) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) t[i] = std::sin(phase + 1.7 * static_cast<double>(i * i + i));
  return t;
}

// Biases that hold every ReLU well open or well shut: differences must not step over its kink.
Tensor<double> biases(Index n, Activation activation) {
  Tensor<double> b = numbers({n}, 3);
  if (activation == Activation::relu)
    for (Index i = 0; i < n; ++i) b[i] += i % 2 == 0 ? 100 : -100;
  return b;
}

GradcheckReport check_matmul() {
  const std::vector<Tensor<double>> in{numbers({3, 5}, 1), numbers({5, 4}, 2)};
  return gradcheck([](Tape<double>&, auto v) { return matmul(v[0], v[1]); }, in);
}

GradcheckReport check_dense(Activation activation) {
  const std::vector<Tensor<double>> in{numbers({4, 3}, 1), numbers({3, 5}, 2), biases(5, activation)};
  return gradcheck([=](Tape<double>&, auto v) { return dense(v[0], v[1], v[2], activation); }, in);
}

GradcheckReport check_conv2d(Activation activation, Shape x = {2, 3, 4, 2}, Index out = 3) {
  const std::vector<Tensor<double>> in{numbers(x, 1), numbers({3, 3, x[3], out}, 2), biases(out, activation)};
  return gradcheck([=](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2], activation); }, in);
}

GradcheckReport check_feature_distance() {
  const std::vector<double> weights{0.3, 1.1, 0.7, 1.9, 0.2};
  auto a = numbers({2, 3, 2, 5}, 1), b = numbers({2, 3, 2, 5}, 2);
  for (Tensor<double>* t : {&a, &b})
    for (double& v : t->data) v = 0.55 + 0.45 * v;
  const std::vector<Tensor<double>> in{a, b};
  return gradcheck([&](Tape<double>&, auto v) { return feature_distance<double>(v[0], v[1], weights); }, in);
}

template <class Layer, class Options>
GradcheckReport check_layer(const Options& options, Shape input) {
  ParamStore<double> store;
  const Layer layer(store, "layer", options, 5);
  const std::vector<Tensor<double>> in{numbers(input, 1)};
  return gradcheck_module([&](auto&, const auto& params, auto v) { return layer(params, v[0]); }, store, in);
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases_linear() {
  return {
      {"matmul", check_matmul},
      {"feature_distance", check_feature_distance},
      {"dense", [] { return check_dense(Activation::none); }},
      {"dense with relu", [] { return check_dense(Activation::relu); }},
      {"dense layer",
       [] {
         return check_layer<Dense<double>>(DenseOptions{.in = 3, .out = 4}, {5, 3});
       }},
      {"conv2d", [] { return check_conv2d(Activation::none); }},
      {"conv2d with relu", [] { return check_conv2d(Activation::relu); }},
      {"conv2d with relu of wide layers",  // Winograd's way
       [] {
         return check_conv2d(Activation::relu, {2, 5, 7, 8}, 16);
       }},
      {"conv2d with steps and a border",
       [] {
         const std::vector<Tensor<double>> in{numbers({2, 5, 7, 2}, 1), numbers({4, 4, 2, 3}, 2),
                                              numbers({3}, 3)};
         return gradcheck(
             [](Tape<double>&, auto v) { return conv2d(v[0], v[1], v[2], {.stride = 3, .padding = 2}); }, in);
       }},
      {"conv2d layer",
       [] {
         return check_layer<Conv2d<double>>(Conv2dOptions{.in = 2, .out = 3}, {1, 3, 4, 2});
       }},
  };
}

}  // namespace fieldmark
