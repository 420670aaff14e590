#include <fieldmark/engine/ops/batch_norm.h>
#include <fieldmark/engine/ops/group_norm.h>
#include <fieldmark/engine/ops/layer_norm.h>

#include <algorithm>

#include "numerics_cases_parts.h"

namespace fieldmark {
namespace {

using Real = long double;
constexpr Real kEps = 1e-5L;  // default of the options

// y and its gradients for the cotangent g; x_i is normalised over the set set_of(i).
struct Exact {
  std::vector<Real> y, dx, dgamma, dbeta;
};
template <class T, class Set>
Exact exact_norm(const std::vector<Tensor<T>>& in, const Tensor<T>& g, Index sets, Set set_of) {
  const Tensor<T>&x = in[0], &gamma = in[1], &beta = in[2];
  const Index n = x.size(), channels = gamma.size();
  std::vector<Real> count(at(sets)), mean(at(sets)), var(at(sets)), a(at(sets)), b(at(sets));
  for (Index i = 0; i < n; ++i) ++count[set_of(i)], mean[set_of(i)] += x[i];
  for (std::size_t s = 0; s < mean.size(); ++s) mean[s] /= count[s];
  for (Index i = 0; i < n; ++i) var[set_of(i)] += (x[i] - mean[set_of(i)]) * (x[i] - mean[set_of(i)]);
  const auto inverse = [&](std::size_t s) { return 1 / std::sqrt(var[s] / count[s] + kEps); };
  const auto unit = [&](Index i) { return (x[i] - mean[set_of(i)]) * inverse(set_of(i)); };
  Exact e{std::vector<Real>(at(n)), std::vector<Real>(at(n)), std::vector<Real>(at(channels)),
          std::vector<Real>(at(channels))};
  for (Index i = 0; i < n; ++i) {
    const Real to_unit = static_cast<Real>(g[i]) * gamma[i % channels];
    e.y[at(i)] = unit(i) * gamma[i % channels] + beta[i % channels];
    e.dgamma[at(i % channels)] += g[i] * unit(i);
    e.dbeta[at(i % channels)] += g[i];
    a[set_of(i)] += to_unit;
    b[set_of(i)] += to_unit * unit(i);
  }
  for (Index i = 0; i < n; ++i) {
    const std::size_t s = set_of(i);
    e.dx[at(i)] = inverse(s) * (static_cast<Real>(g[i]) * gamma[i % channels] - a[s] / count[s] -
                                unit(i) * b[s] / count[s]);
  }
  return e;
}

template <class T>
std::vector<Tensor<T>> inputs(Shape s, double centre, double spread) {
  return {scattered<T>(s, centre - spread, centre + spread, 1), scattered<T>({s[-1]}, 0.5, 1.5, 2),
          scattered<T>({s[-1]}, -0.5, 0.5, 3)};
}

// Errors are relative to the largest magnitude of the tensor.
template <class T>
void compare_all(const std::vector<std::vector<T>>& got, const Exact& want, WorstError& error) {
  const std::vector<Real>* kinds[] = {&want.y, &want.dx, &want.dgamma, &want.dbeta};
  for (std::size_t k = 0; k < 4; ++k) {
    Real largest = std::numeric_limits<T>::min();
    for (const Real v : *kinds[k]) largest = std::max(largest, std::abs(v));
    for (std::size_t i = 0; i < got[k].size(); ++i) error.compare(got[k][i], (*kinds[k])[i], largest);
  }
}

constexpr Index kGroups = 2;
const auto kGroupNorm = [](auto&, const auto& v) {
  return group_norm(v[0], v[1], v[2], {.groups = kGroups});
};
const auto kBatchNorm = [](auto&, const auto& v) { return batch_norm(v[0], v[1], v[2]); };

template <class T, class Op, class Set>
void compare_norm(const std::vector<Tensor<T>>& in, const Op& op, Index sets, Set set_of, WorstError& error) {
  const auto g = scattered<T>(in[0].shape, -1, 1, 4);
  const auto got = values_and_gradients<T>(op, in, [&](Shape) -> const Tensor<T>& { return g; });
  compare_all(got, exact_norm<T>(in, g, sets, set_of), error);
}

template <class T>
void compare_group_norm(const std::vector<Tensor<T>>& in, WorstError& error) {
  const Shape s = in[0].shape;
  const Index image = s[1] * s[2] * s[3], width = s[3] / kGroups;
  compare_norm(
      in, kGroupNorm, s[0] * kGroups, [=](Index i) { return at(i / image * kGroups + i % s[3] / width); },
      error);
}

template <class T>
void compare_batch_norm(const std::vector<Tensor<T>>& in, WorstError& error) {
  const Index channels = in[0].shape[3];
  compare_norm(
      in, kBatchNorm, channels, [=](Index i) { return at(i % channels); }, error);
}

template <class T>
void compare_layer_norm(const std::vector<Tensor<T>>& in, WorstError& error) {
  const Index columns = in[0].shape[-1];
  compare_norm(
      in, [](auto&, const auto& v) { return layer_norm(v[0], v[1], v[2]); }, in[0].size() / columns,
      [=](Index i) { return at(i / columns); }, error);
}

// A constant image, or a set of one element, gives exactly beta and finite gradients.
template <class T>
void compare_constant(WorstError& error) {
  for (const Shape s : {Shape{1, 8, 8, 4}, Shape{2, 1, 1, 2}})
    for (const double level : {0.0, 0.1, 255.0, 1e6, -3e7}) {
      auto in = inputs<T>(s, 0, 1);
      std::fill(in[0].data.begin(), in[0].data.end(), static_cast<T>(level));
      const auto group = values_and_gradients<T>(kGroupNorm, in, ones<T>),
                 batch = values_and_gradients<T>(kBatchNorm, in, ones<T>);
      for (const auto* got : {&group, &batch}) {
        for (std::size_t i = 0; i < (*got)[0].size(); ++i)
          error.equal((*got)[0][i], in[2].data[i % at(s[3])]);
        for (const T v : (*got)[1]) error.equal(std::isfinite(v), true);
        for (const T v : (*got)[2]) error.equal(v, 0);  // gradient of gamma: every normalised value is 0
      }
    }
}

}  // namespace

void add_norm_numerics(std::vector<NumericsCase>& cases) {
  const std::string largest = "largest of value, dx, dgamma, dbeta";
  const Shape s{2, 33, 31, 24};
  add_numerics(cases, "group_norm, batch_norm: zero variance and one element", "bits", 0, 0,
               [](auto t, WorstError& e) { compare_constant<decltype(t)>(e); });
  add_numerics(cases, "group_norm: 0.3 +- 1", largest, 4e-7, 1e-15,
               [=](auto t, WorstError& e) { compare_group_norm(inputs<decltype(t)>(s, 0.3, 1), e); });
  // The mean is rounded to a double: an error of 1e3 and 1e6 ulp of the spread.
  add_numerics(cases, "group_norm: 1000 +- 1", largest, 4e-7, 1e-12,
               [=](auto t, WorstError& e) { compare_group_norm(inputs<decltype(t)>(s, 1000, 1), e); });
  add_numerics(cases, "group_norm: variance below eps, 1000 +- 1e-3", largest, 4e-7, 1e-9,
               [=](auto t, WorstError& e) { compare_group_norm(inputs<decltype(t)>(s, 1000, 1e-3), e); });
  add_numerics(cases, "batch_norm: 1000 +- 1e-3", largest, 4e-7, 1e-9,
               [=](auto t, WorstError& e) { compare_batch_norm(inputs<decltype(t)>(s, 1000, 1e-3), e); });
  // The mean is a sum of 257 values in double: an error of up to 257 / 4 u 1000, over the spread.
  const Shape rows{40, 257};
  add_numerics(cases, "layer_norm: 1000 +- 1, gradients", largest, 4e-7, 1e-12,
               [=](auto t, WorstError& e) { compare_layer_norm(inputs<decltype(t)>(rows, 1000, 1), e); });
  add_numerics(cases, "layer_norm: variance below eps, 1000 +- 1e-3, gradients", largest, 4e-7, 1e-9,
               [=](auto t, WorstError& e) { compare_layer_norm(inputs<decltype(t)>(rows, 1000, 1e-3), e); });
}

}  // namespace fieldmark
