#include "fieldmark/extractor/numerics_cases.h"

#include "fieldmark/extractor/evidence_pool.h"

namespace fieldmark::extractor {
namespace {

using Real = long double;
constexpr Index kCasePlaces = 700, kCells = 12, kBits = 3;

template <class T>
struct Places {
  Tensor<T> sign{Shape{kCasePlaces}}, index{Shape{kCasePlaces, kCells + 1}};
};

// Places certain of their cell and its sign, with logits of this size; all but every fifth show background.
template <class T>
Places<T> sure_places(double logit) {
  Places<T> p;
  const auto noise = scattered<T>(p.index.shape, -1, 1, 1);
  for (Index i = 0; i < kCasePlaces; ++i) {
    p.sign[i] = static_cast<T>((i % 3 == 0 ? -1 : 1) * logit);
    for (Index c = 0; c <= kCells; ++c) p.index[i * (kCells + 1) + c] = noise[i * (kCells + 1) + c];
    p.index[i * (kCells + 1) + (i % 5 == 0 ? i % kCells : kCells)] = static_cast<T>(logit);
  }
  return p;
}

// [cells] sum of q_c tanh(s / 2), then the foreground, then [cells] sum of q_c, by the formulas.
template <class T>
std::vector<Real> exact_sums(const Places<T>& p) {
  std::vector<Real> sums(2 * kCells + 1);
  for (Index i = 0; i < kCasePlaces; ++i) {
    const T* row = &p.index[i * (kCells + 1)];
    Real most = row[0], total = 0;
    for (Index c = 1; c <= kCells; ++c) most = std::max<Real>(most, row[c]);
    for (Index c = 0; c <= kCells; ++c) total += std::exp(row[c] - most);
    for (Index c = 0; c < kCells; ++c) {
      const Real q = std::exp(row[c] - most) / total;
      sums[static_cast<std::size_t>(c)] += q * std::tanh(static_cast<Real>(p.sign[i]) / 2);
      sums[kCells] += q;
      sums[static_cast<std::size_t>(kCells + 1 + c)] += q;
    }
  }
  return sums;
}

template <class T>
void compare_pool(double logit, WorstError& error) {
  const auto p = sure_places<T>(logit);
  std::vector<T> code(kCells * kBits);
  for (std::size_t c = 0; c < kCells; ++c) code[c * kBits + c % kBits] = c % 2 == 0 ? T(1) : T(-1);
  const auto got = values_and_gradients<T>(
      [&](auto&, const auto& v) { return pooled_bits(v[0], v[1], code, kBits); }, {p.sign, p.index}, ones<T>);
  const auto sums = exact_sums(p);
  for (std::size_t b = 0; b < kBits; ++b) {
    Real want = 0;
    for (std::size_t c = 0; c < kCells; ++c) want += sums[c] * code[c * kBits + b];
    error.compare(got[0][b], want / (sums[kCells] / kBits + 1e-3L), 1);
  }
  for (const auto* g : {&got[1], &got[2]})
    for (const T v : *g) error.equal(std::isfinite(v), true);
}

void compare_evidence(double logit, WorstError& error) {
  const auto p = sure_places<float>(logit);
  std::vector<double> got(kCells);
  cell_evidence(p.sign.data.data(), p.index.data.data(), kCasePlaces, kCells, got.data());
  const auto sums = exact_sums(p);
  for (std::size_t c = 0; c < kCells; ++c)
    error.compare(got[c], sums[c] / std::pow(sums[kCells + 1 + c] + 0.25L, 0.3L), sums[kCells]);
}

}  // namespace

std::vector<NumericsCase> numerics_cases() {
  std::vector<NumericsCase> all;
  for (const double logit : {0.5, 5.0, 1e4}) {
    char name[80];
    std::snprintf(name, sizeof name, "evidence_pool: bits of places sure by %g", logit);
    add_numerics(all, name, "1", 2e-7, 5e-16,
                 [=](auto t, WorstError& e) { compare_pool<decltype(t)>(logit, e); });
    std::snprintf(name, sizeof name, "evidence_pool: cells of places sure by %g", logit);
    all.push_back({name, "double", "foreground", 2e-16, [=] {
                     WorstError e;
                     compare_evidence(logit, e);
                     return e;
                   }});
  }
  return all;
}

}  // namespace fieldmark::extractor
