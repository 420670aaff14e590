#include "tone_fit.h"
#include <fieldmark/engine/shape_checks.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr double kHold = 1e-4;  // weight of the identity, relative to all pixels
constexpr double kDark = 0.02;  // the slope of v ln v diverges at 0
constexpr int kMax = 4, kMin = 5, kBent = 6;

using ToneMatrix = Eigen::Matrix<double, ToneFit::kTerms, ToneFit::kTerms>;
using ToneVector = Eigen::Matrix<double, ToneFit::kTerms, 1>;

double bent(double v) { return v > 0 ? v * std::log(v) : 0; }

// Returns the terms that all channels share; the last, v ln v, is 0.
ToneVector shared_terms(const float* v) {
  ToneVector t;
  t << 1, static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2]),
      static_cast<double>(std::max({v[0], v[1], v[2]})), static_cast<double>(std::min({v[0], v[1], v[2]})), 0;
  return t;
}

std::array<ToneVector, 3> zeros() { return {ToneVector::Zero(), ToneVector::Zero(), ToneVector::Zero()}; }

// Sums over all pixels: the normal equations of each channel.
struct Sums {
  ToneMatrix shared = ToneMatrix::Zero();
  std::array<ToneVector, 3> bends = zeros();    // last column of the matrix
  std::array<ToneVector, 3> changes = zeros();  // right-hand side
  double total = 0;

  void add(double weight, const float* render, const float* image) {
    const ToneVector t = shared_terms(render);
    shared.selfadjointView<Eigen::Lower>().rankUpdate(t, weight);
    for (std::size_t c = 0; c < 3; ++c) {
      const double v = static_cast<double>(render[c]), b = bent(v),
                   change = static_cast<double>(image[c]) - v;
      bends[c] += weight * b * t;
      bends[c][kBent] += weight * b * b;
      changes[c] += weight * change * t;
      changes[c][kBent] += weight * change * b;
    }
    total += weight;
  }

  Sums& operator+=(const Sums& other) {
    shared += other.shared;
    for (std::size_t c = 0; c < 3; ++c) {
      bends[c] += other.bends[c];
      changes[c] += other.changes[c];
    }
    total += other.total;
    return *this;
  }

  ToneVector solve(std::size_t channel) const {
    ToneMatrix normal = shared.selfadjointView<Eigen::Lower>();
    normal.row(kBent) = bends[channel].transpose();
    normal.col(kBent) = bends[channel];
    normal.diagonal().array() += kHold * total;
    return normal.ldlt().solve(changes[channel]);
  }
};

}  // namespace

std::array<double, 3> ToneFit::at(const float* v) const {
  const ToneVector t = shared_terms(v);
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k + 1 < kTerms; ++k) out[c] += terms[c][k] * t[static_cast<int>(k)];
    out[c] += terms[c][kBent] * bent(static_cast<double>(v[c]));
  }
  return out;
}

std::array<std::array<double, 3>, 3> ToneFit::slope(const float* v) const {
  const auto most = static_cast<std::size_t>(std::max_element(v, v + 3) - v),
             least = static_cast<std::size_t>(std::min_element(v, v + 3) - v);
  std::array<std::array<double, 3>, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t k = 0; k < 3; ++k) out[c][k] = terms[c][k + 1];
    out[c][most] += terms[c][kMax];
    out[c][least] += terms[c][kMin];
    out[c][c] += terms[c][kBent] * (1 + std::log(std::max(static_cast<double>(v[c]), kDark)));
  }
  return out;
}

Tensor<float> ToneFit::operator()(const Tensor<float>& image) const {
  Tensor<float> out(image.shape);
  parallel_for(image.size() / 3, kPixelChunk, [&](Index begin, Index end) {
    for (Index i = 3 * begin; i < 3 * end; i += 3) {
      const std::array<double, 3> t = at(&image.data[static_cast<std::size_t>(i)]);
      for (std::size_t c = 0; c < 3; ++c) out[i + static_cast<Index>(c)] = static_cast<float>(t[c]);
    }
  });
  return out;
}

ToneFit fit_tones(const Tensor<float>& render, const Tensor<float>& image, std::span<const double> weight) {
  check_rank("fit_tones", "render", render.shape, 3, "[H, W, 3]");
  check_extent("fit_tones", "render", render.shape, 2, 3, "red, green, blue");
  if (image.shape != render.shape || std::ssize(weight) * 3 != render.size())
    throw ShapeError("[fit_tones] image and weight must fit the render " + render.shape.str() +
                     ", got shape " + image.shape.str() + " and " + std::to_string(weight.size()) +
                     " weights");
  const Sums sums = ordered_sum(std::ssize(weight), Sums{}, [&](Index begin, Index end, Sums& part) {
    for (auto p = static_cast<std::size_t>(begin); p < static_cast<std::size_t>(end); ++p)
      if (weight[p] > 0) part.add(weight[p], &render.data[3 * p], &image.data[3 * p]);
  });
  ToneFit fit;
  if (!(sums.total > 0)) return fit;
  for (std::size_t c = 0; c < 3; ++c) {
    const ToneVector change = sums.solve(c);
    for (std::size_t k = 0; k < ToneFit::kTerms; ++k) fit.terms[c][k] += change[static_cast<int>(k)];
  }
  return fit;
}

}  // namespace fieldmark::watermark
