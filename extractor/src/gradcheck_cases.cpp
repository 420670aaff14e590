#include "fieldmark/extractor/gradcheck_cases.h"

#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/ops/slice.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "fieldmark/extractor/centred_image.h"
#include "fieldmark/extractor/dense_extractor.h"
#include "fieldmark/extractor/evidence_pool.h"
#include "fieldmark/extractor/pooled_extractor.h"

namespace fieldmark::extractor {
namespace {

// Size of a direction's entries. Thousands of weights move together, so the finite-difference step must be
// smaller than for a single number.
constexpr double kDirection = 0.02;
constexpr Index kImageDirections = 6;

// Fixed pattern-free numbers in (-1, 1).
Tensor<double> numbers(Shape shape, double phase) {
  Tensor<double> t(shape);
  for (Index i = 0; i < t.size(); ++i) t[i] = std::sin(phase + 1.7 * static_cast<double>(i * i + i));
  return t;
}

Tensor<double> view_image(Shape shape) {
  Tensor<double> t = numbers(shape, 1);
  for (double& v : t.data) v = 0.5 + 0.5 * v;
  return t;
}

// Keeps every ReLU clearly open or closed, alternating, so that differences do not cross a kink.
void keep_from_kinks(ParamStore<double>& store) {
  for (const auto& e : store.entries()) {
    const double size = e.name.ends_with("norm/beta") ? 20 : e.name.ends_with("hidden/bias") ? 400 : 0;
    for (Index i = 0; size > 0 && i < e.shape.size(); ++i)
      store.values()[static_cast<std::size_t>(e.offset + i)] = i % 2 == 0 ? size : -size;
  }
}

bool trained(const ParamStore<double>::Entry& e) { return is_trained(e.role); }

// theta = theta_0 + t_k d on the k-th tensor, with a fixed direction d. Differentiates one number per tensor;
// one per parameter, 50,000 in all, would take minutes.
Params<double> along_directions(const ParamStore<double>& store, const Tensor<double>& direction,
                                Var<double> t) {
  Tape<double>& tape = t.tape();
  double* theta = nullptr;
  const Var<double> all = tape.output({store.size()}, &theta, {t});
  for (std::size_t k = 0; k < store.entries().size(); ++k) {
    const auto& e = store.entries()[k];
    for (Index i = e.offset; i < e.offset + e.shape.size(); ++i)
      theta[i] = store.values()[static_cast<std::size_t>(i)] + (trained(e) ? t.value()[k] * direction[i] : 0);
  }
  // dt_k = <d, dtheta> on the k-th tensor.
  const ParamStore<double>* layout = &store;
  const double* d = direction.data.data();
  tape.on_backward(all, [t, layout, d](const double* dtheta) {
    double* dt = t.grad_acc();
    assert(dt);  // backward runs only if its single input needs a gradient
    for (const auto& e : layout->entries()) {
      for (Index i = e.offset; trained(e) && i < e.offset + e.shape.size(); ++i) *dt += d[i] * dtheta[i];
      ++dt;
    }
  });
  return {store, all};
}

// base + sum_k t_k d_k with fixed directions d_k.
Var<double> along_directions(const Tensor<double>& base, const Tensor<double>& directions, Var<double> t) {
  const Var<double> shift = matmul(t, t.tape().constant(directions));
  return add(t.tape().constant(base), t.tape().reshape(shift, base.shape));
}

template <class F>
GradcheckReport check_network(ParamStore<double>& store, const Tensor<double>& image, F run) {
  keep_from_kinks(store);
  const auto scaled = [](Shape shape) {
    Tensor<double> t = numbers(shape, 2);
    for (double& v : t.data) v *= kDirection;
    return t;
  };
  const Tensor<double> of_parameters = scaled({store.size()}),
                       of_image = scaled({kImageDirections, image.size()});
  const std::vector<Tensor<double>> in{Tensor<double>({static_cast<Index>(store.entries().size())}),
                                       Tensor<double>({1, kImageDirections})};
  return gradcheck(
      [&](Tape<double>&, auto v) {
        return run(along_directions(store, of_parameters, v[0]), along_directions(image, of_image, v[1]));
      },
      in);
}

GradcheckReport check_dense_extractor() {
  ParamStore<double> store;
  const DenseExtractor<double> net(store, "net", {.classes = 3, .base = 8}, 5);
  return check_network(
      store, view_image({1, 17, 18, 3}), [&](const Params<double>& params, Var<double> image) {
        const auto out = net(params, image);
        return concatenate({image.tape().reshape(out.sign, {out.height * out.width, 1}), out.index});
      });
}

GradcheckReport check_pooled_extractor(bool running) {
  ParamStore<double> store;
  const PooledExtractor<double> net(store, "net", {.n_bits = 2, .channels = 4, .layers = 3}, 5);
  // Wide enough that values normalised by it stay below the bias of keep_from_kinks().
  for (const auto& e : store.entries())
    if (e.name.ends_with("running_variance")) std::ranges::fill(store.values(store.find(e.name)), 1e4);
  return check_network(store, view_image({2, 5, 4, 3}),
                       [&](const Params<double>& params, Var<double> images) {
                         return running ? net.evaluate(params, images) : net(params, images);
                       });
}

GradcheckReport check_centred_image() {
  const std::vector<Tensor<double>> in{view_image({2, 3, 5, 3})};
  return gradcheck([](Tape<double>&, auto v) { return centred_image(v[0], 2); }, in);
}

GradcheckReport check_evidence_pool() {
  const std::vector<double> code{1, 0, 0, 0, -1, 0,
                                 0, 0, 0, 0, 1,  0};  // 4 cells, 3 bits; one cell and one bit are unused
  const std::vector<Tensor<double>> in{numbers({6}, 1), numbers({6, 5}, 2)};
  return gradcheck([&](Tape<double>&, auto v) { return pooled_bits(v[0], v[1], code, 3); }, in);
}

}  // namespace

std::vector<GradcheckCase> gradcheck_cases() {
  return {
      {"centred_image", check_centred_image},
      {"dense_extractor", check_dense_extractor},
      {"evidence_pool: pooled_bits", check_evidence_pool},
      {"pooled_extractor: batch statistics", [] { return check_pooled_extractor(false); }},
      {"pooled_extractor: running statistics", [] { return check_pooled_extractor(true); }},
  };
}

}  // namespace fieldmark::extractor
