#include "fieldmark/extractor/evidence_pool.h"

#include <fieldmark/engine/ops/softmax.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/shape_checks.h>

#include <cmath>

namespace fieldmark::extractor {
namespace {

constexpr Index kPlaces = 256;             // per chunk
constexpr double kLeastForeground = 1e-3;  // places per bit: an empty image has no evidence instead of noise
constexpr double kSliver = 0.25;           // places: what a cell must show to count
constexpr double kTogether = 0.3;          // exponent of a cell's places that its evidence is divided by

template <class T>
void check_pool(Var<T> sign, Var<T> index, std::span<const T> code, Index n_bits) {
  check_rank("pooled_bits", "sign", sign.shape(), 1, "[places]");
  check_rank("pooled_bits", "index", index.shape(), 2, "[places, cells + 1]");
  check_extent("pooled_bits", "index", index.shape(), 0, sign.shape()[0], "the places of sign");
  if (index.shape()[1] < 1)
    throw ShapeError("[pooled_bits] index must have a column for the background, got shape " +
                     index.shape().str());
  if (n_bits < 1) throw ValueError("[pooled_bits] n_bits must be at least 1, got " + std::to_string(n_bits));
  const Index want = (index.shape()[1] - 1) * n_bits;
  if (static_cast<Index>(code.size()) != want)
    throw ShapeError("[pooled_bits] code must have " + std::to_string(want) +
                     " numbers (cells x bits), got " + std::to_string(code.size()));
}

// sums[c] = sum_p tau_p q_c(p) for c < cells, and sum_p (1 - q_cells(p)) in sums[cells]; chunks add in order.
template <class T>
double* sums_over_places(Tape<T>& tape, const T* tau, const T* q, Index places, Index cells) {
  const Index pieces = (places + kPlaces - 1) / kPlaces, columns = cells + 1;
  T* parts = tape.scratch(pieces * columns);
  parallel_for(places, kPlaces, [=](Index begin, Index end) {
    T* part = parts + begin / kPlaces * columns;
    std::fill_n(part, columns, T(0));
    for (Index p = begin; p < end; ++p) {
      const T* row = q + p * columns;
      for (Index c = 0; c < cells; ++c) part[c] += tau[p] * row[c];
      part[cells] += 1 - row[cells];
    }
  });
  auto* sums = tape.template scratch<double>(columns);
  std::fill_n(sums, columns, 0.0);
  for (Index k = 0; k < pieces; ++k)
    for (Index c = 0; c < columns; ++c) sums[c] += static_cast<double>(parts[k * columns + c]);
  return sums;
}

// Eight partial sums, so that the loop vectorises.
template <class T>
T dot(const T* a, const T* b, Index n) {
  T acc[8] = {};
  Index i = 0;
  for (; i + 8 <= n; i += 8)
    for (Index k = 0; k < 8; ++k) acc[k] += a[i + k] * b[i + k];
  for (; i < n; ++i) acc[0] += a[i] * b[i];
  return ((acc[0] + acc[1]) + (acc[2] + acc[3])) + ((acc[4] + acc[5]) + (acc[6] + acc[7]));
}

// The coefficients for turning the gradient of the sums into those of sign and index.
template <class T>
struct PoolGradient {
  const T *tau, *q;
  const T* cell;  // [C] v, dL / dA_c
  T background;   // u, dL / dq_C(p)
  Index places, cells;

  void add_to(Var<T> sign, Var<T> index) const {
    T *ds = sign.grad_acc(), *dx = index.grad_acc();
    parallel_for(places, kPlaces, [&](Index begin, Index end) {
      for (Index p = begin; p < end; ++p) {
        const T* row = q + p * (cells + 1);
        const T m = dot(row, cell, cells);
        if (ds) ds[p] += m * (1 - tau[p] * tau[p]) / 2;
        if (!dx) continue;
        T* to = dx + p * (cells + 1);
        const T mean = tau[p] * m + row[cells] * background;
        for (Index c = 0; c < cells; ++c) to[c] += row[c] * (tau[p] * cell[c] - mean);
        to[cells] += row[cells] * (background - mean);
      }
    });
  }
};

}  // namespace

template <class T>
Var<T> pooled_bits(Var<T> sign, Var<T> index, std::span<const std::type_identity_t<T>> code, Index n_bits) {
  check_pool<T>(sign, index, code, n_bits);
  Tape<T>& tape = sign.tape();
  const Index places = sign.shape()[0], cells = index.shape()[1] - 1;
  const T* q = softmax(tape.constant(index.value(), index.shape())).value();
  T* tau = tape.scratch(places);
  for (Index p = 0; p < places; ++p) tau[p] = std::tanh(sign.value()[p] / 2);
  const double* sums = sums_over_places(tape, tau, q, places, cells);
  const double norm = sums[cells] / static_cast<double>(n_bits) + kLeastForeground;
  T* y = nullptr;
  const Var<T> out = tape.output({n_bits}, &y, {sign, index});
  const T* w = code.data();
  for (Index b = 0; b < n_bits; ++b) {
    double sum = 0;
    for (Index c = 0; c < cells; ++c) sum += sums[c] * static_cast<double>(w[c * n_bits + b]);
    y[b] = static_cast<T>(sum / norm);
  }

  // With A_c = sum_p tau_p q_c(p), D = sum_p (1 - q_C(p)) / N_b + 1e-3 and L_b = sum_c A_c code[c, b] / D:
  //   v_c = dL/dA_c = sum_b dL_b code[c, b] / D,   u = dL/dq_C(p) = sum_b dL_b L_b / (D N_b),
  //   dq_c = tau_p v_c,   dtau_p = sum_c q_c v_c = m_p,   ds_p = m_p (1 - tau_p^2) / 2,
  // and through the softmax dx_c = q_c (dq_c - sum_k q_k dq_k) with sum_k q_k dq_k = tau_p m_p + q_C u.
  T* v = tape.scratch(cells);
  tape.on_backward(out, [=](const T* dy) {
    double u = 0;
    for (Index b = 0; b < n_bits; ++b) u += static_cast<double>(dy[b]) * static_cast<double>(y[b]);
    for (Index c = 0; c < cells; ++c)
      v[c] = static_cast<T>(static_cast<double>(dot(dy, w + c * n_bits, n_bits)) / norm);
    const T background = static_cast<T>(u / (norm * static_cast<double>(n_bits)));
    PoolGradient<T>{tau, q, v, background, places, cells}.add_to(sign, index);
  });
  return out;
}

void cell_evidence(const float* sign, const float* index, Index places, Index cells, double* evidence) {
  if (places < 0 || cells < 0)
    throw ValueError("[cell_evidence] places and cells must not be negative, got " + std::to_string(places) +
                     " and " + std::to_string(cells));
  // Each chunk holds the cells' sums of q tanh(s / 2), then those of q.
  const Index pieces = (places + kPlaces - 1) / kPlaces;
  std::vector<double> parts(static_cast<std::size_t>(pieces * 2 * cells));
  parallel_for(places, kPlaces, [&](Index begin, Index end) {
    double *part = parts.data() + begin / kPlaces * 2 * cells, *share = part + cells;
    std::vector<double> q(static_cast<std::size_t>(cells) + 1);
    for (Index p = begin; p < end; ++p) {
      const float* row = index + p * (cells + 1);
      const double most = static_cast<double>(*std::max_element(row, row + cells + 1));
      double total = 0;
      for (std::size_t c = 0; c < q.size(); ++c) total += q[c] = std::exp(static_cast<double>(row[c]) - most);
      const double tau = std::tanh(static_cast<double>(sign[p]) / 2);
      for (Index c = 0; c < cells; ++c) {
        const double here = q[static_cast<std::size_t>(c)] / total;
        part[c] += tau * here;
        share[c] += here;
      }
    }
  });
  for (Index k = 1; k < pieces; ++k)
    for (Index i = 0; i < 2 * cells; ++i)
      parts[static_cast<std::size_t>(i)] += parts[static_cast<std::size_t>(k * 2 * cells + i)];
  for (Index c = 0; pieces > 0 && c < cells; ++c)
    evidence[c] += parts[static_cast<std::size_t>(c)] *
                   std::pow(parts[static_cast<std::size_t>(cells + c)] + kSliver, -kTogether);
}

template Var<float> pooled_bits(Var<float>, Var<float>, std::span<const float>, Index);
template Var<double> pooled_bits(Var<double>, Var<double>, std::span<const double>, Index);

}  // namespace fieldmark::extractor
