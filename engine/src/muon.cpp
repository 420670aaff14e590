#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/muon.h>
#include <fieldmark/engine/ops/arithmetic.h>
#include <fieldmark/engine/ops/layout.h>
#include <fieldmark/engine/ops/matmul.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "optimiser_checks.h"

namespace fieldmark {
namespace {

constexpr double kQuintic[] = {3.4445, -4.775, 2.0315};  // a, b, c
// Five steps on the small square product alone, which is formed anew in between: small singular values grow
// by a in each step, and so does the rounding of their squares.
constexpr int kRounds[] = {2, 3};
constexpr double kRmsOfAdam = 0.2;  // of a step of Adam, relative to its step size

// Takes steps x <- x p(g) of the polynomial p(g) = a + b g + c g^2 with g = x^T x. The products commute, so
// g <- p(g)^2 g as well, and x is multiplied once, by the product f + s of all p = a + r. For a wide matrix,
// g = x x^T and x <- p(g) x.
template <class T>
void apply_polynomial(T* d, Index rows, Index columns, int steps, Tape<T>& tape) {
  const double a = kQuintic[0], b = kQuintic[1], c = kQuintic[2];
  const bool tall = rows > columns;
  tape.reset();
  const Var<T> x = tape.constant(d, {rows, columns});
  const auto remainder = [&](const Var<T>& of) { return add(scale(of, b), scale(matmul(of, of), c)); };
  Var<T> g = tall ? matmul(transpose(x), x) : matmul(x, transpose(x)), r = remainder(g), s = r;
  double f = a;
  for (int k = 1; k < steps; ++k) {
    const Var<T> h = add(scale(g, a), matmul(r, g));
    g = add(scale(h, a), matmul(r, h));
    r = remainder(g);
    s = add(add(scale(r, f), scale(s, a)), matmul(s, r));
    f *= a;
  }
  const Var<T> next = add(scale(x, f), tall ? matmul(x, s) : matmul(s, x));
  std::copy_n(next.value(), rows * columns, d);
}

}  // namespace

template <class T>
void orthogonalise(T* d, Index rows, Index columns, Tape<T>& tape) {
  const Index n = rows * columns;
  if (n == 0) return;
  const auto square_of = [d, n] {
    double square = 0;
    for (Index i = 0; i < n; ++i) square += static_cast<double>(d[i]) * static_cast<double>(d[i]);
    return square;
  };
  double square = square_of();
  // The square of a double may be infinite or 0 where the number is not.
  if (!(square >= std::numeric_limits<double>::min() && std::isfinite(square))) {
    double largest = 0;
    for (Index i = 0; i < n; ++i) largest = std::max(largest, std::abs(static_cast<double>(d[i])));
    if (largest >= static_cast<double>(std::numeric_limits<T>::min()) && std::isfinite(largest)) {
      for (Index i = 0; i < n; ++i) d[i] = static_cast<T>(static_cast<double>(d[i]) / largest);
      square = square_of();
    }
  }
  const double norm = std::sqrt(square);
  // Below the normal numbers, 1 / norm would be infinite. NaN stays NaN.
  const T factor =
      norm < static_cast<double>(std::numeric_limits<T>::min()) ? T(0) : static_cast<T>(1 / norm);
  for (Index i = 0; i < n; ++i) d[i] *= factor;
  for (const int steps : kRounds) apply_polynomial(d, rows, columns, steps, tape);
}

template <class T>
Muon<T>::Muon(const ParamStore<T>& store, const std::vector<std::string>& names, MuonOptions o)
    : options_(o) {
  check_number("Muon", "lr", o.lr, o.lr > 0, "positive");
  check_number("Muon", "momentum", o.momentum, o.momentum >= 0 && o.momentum < 1, "in [0, 1)");
  for (const std::string& pattern : names) detail::check_pattern("Muon", store, pattern);
  for (const auto& e : store.entries()) {
    const auto matches = [&](const std::string& pattern) { return name_matches(pattern, e.name); };
    if (!is_trained(e.role) || std::ranges::none_of(names, matches)) continue;
    if (e.shape.rank() < 2)
      throw ShapeError("[Muon] '" + e.name + "' must have two axes or more, got shape " + e.shape.str());
    const Index columns = e.shape[e.shape.rank() - 1];
    matrices_.push_back({e.offset, columns > 0 ? e.shape.size() / columns : 0, columns});
  }
  std::ranges::stable_sort(matrices_, std::greater(), [](const Matrix& m) { return m.rows * m.columns; });
  for (std::size_t i = 0; i < matrices_.size(); ++i) tapes_.push_back(std::make_unique<Tape<T>>());
  velocity_.resize(at(store.size()));
  direction_.resize(at(store.size()));
}

template <class T>
void Muon<T>::step(std::span<T> values, std::span<T> grads, double lr_factor) {
  detail::check_step_size("Muon", "values", values.size(), velocity_.size());
  detail::check_step_size("Muon", "grads", grads.size(), velocity_.size());
  parallel_for(std::ssize(matrices_), 1, [&](Index i, Index) {
    update(matrices_[at(i)], *tapes_[at(i)], values.data(), grads.data(), lr_factor);
  });
}

template <class T>
void Muon<T>::update(const Matrix& matrix, Tape<T>& tape, T* values, T* grads, double lr_factor) {
  T *u = velocity_.data(), *d = direction_.data();
  const T momentum = static_cast<T>(options_.momentum);
  for (Index i = matrix.begin; i < matrix.end(); ++i) {
    u[i] = momentum * u[i] + grads[i];
    d[i] = grads[i] + momentum * u[i];
  }
  orthogonalise(d + matrix.begin, matrix.rows, matrix.columns, tape);
  const auto side = static_cast<double>(std::max(matrix.rows, matrix.columns));
  const T lr = static_cast<T>(options_.lr * lr_factor * kRmsOfAdam * std::sqrt(side));
  for (Index i = matrix.begin; i < matrix.end(); ++i) values[i] -= lr * d[i];
  if (options_.zero_grads) std::fill(grads + matrix.begin, grads + matrix.end(), T(0));
}

template class Muon<float>;
template class Muon<double>;
template void orthogonalise(float*, Index, Index, Tape<float>&);
template void orthogonalise(double*, Index, Index, Tape<double>&);

}  // namespace fieldmark
