#include "tone_fit.h"
#include <fieldmark/engine/shape_checks.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr double kDark = 0.02;         // the slope of v ln v diverges at 0
constexpr double kLeastSpread = 2e-3;  // half a grey level
constexpr int kMax = 4, kMin = 5, kBent = 6, kSquare = 7;

using ToneMatrix = Eigen::Matrix<double, ToneFit::kTerms, ToneFit::kTerms>;
using ToneVector = Eigen::Matrix<double, ToneFit::kTerms, 1>;
using SharedMatrix = Eigen::Matrix<double, kBent, kBent>;
using SharedVector = Eigen::Matrix<double, kBent, 1>;

// Returns the terms that all channels share.
SharedVector shared_terms(const float* v) {
  return {1,
          static_cast<double>(v[0]),
          static_cast<double>(v[1]),
          static_cast<double>(v[2]),
          static_cast<double>(std::max({v[0], v[1], v[2]})),
          static_cast<double>(std::min({v[0], v[1], v[2]}))};
}

// Returns the terms of one channel: v ln v and v^2.
Eigen::Vector2d own_terms(float value) {
  const auto v = static_cast<double>(value);
  return {v > 0 ? v * std::log(v) : 0, v * v};
}

template <class T>
std::array<T, 3> zeros() {
  return {T::Zero(), T::Zero(), T::Zero()};
}

// Sums over all pixels: the normal equations of each channel.
struct Sums {
  using OwnColumns = Eigen::Matrix<double, ToneFit::kTerms, 2>;
  SharedMatrix shared = SharedMatrix::Zero();
  std::array<OwnColumns, 3> own = zeros<OwnColumns>();      // last columns of the matrix
  std::array<ToneVector, 3> changes = zeros<ToneVector>();  // right-hand side
  double total = 0;

  void add(double weight, const float* render, const float* image) {
    ToneVector t;
    t.head<kBent>() = shared_terms(render);
    shared.selfadjointView<Eigen::Lower>().rankUpdate(t.head<kBent>(), weight);
    for (std::size_t c = 0; c < 3; ++c) {
      t.tail<2>() = own_terms(render[c]);
      own[c] += weight * t * t.tail<2>().transpose();
      changes[c] += weight * static_cast<double>(image[c] - render[c]) * t;
    }
    total += weight;
  }

  Sums& operator+=(const Sums& other) {
    shared += other.shared;
    for (std::size_t c = 0; c < 3; ++c) {
      own[c] += other.own[c];
      changes[c] += other.changes[c];
    }
    total += other.total;
    return *this;
  }

  ToneVector solve(std::size_t channel, double hold) const {
    ToneMatrix normal;
    normal.topLeftCorner<kBent, kBent>() = shared.selfadjointView<Eigen::Lower>();
    normal.rightCols<2>() = own[channel];
    normal.bottomRows<2>() = own[channel].transpose();
    normal.diagonal().array() += hold * total;
    return normal.ldlt().solve(changes[channel]);
  }
};

}  // namespace

std::array<double, 3> ToneFit::at(const float* v) const {
  ToneVector t;
  t.head<kBent>() = shared_terms(v);
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) {
    t.tail<2>() = own_terms(v[c]);
    for (std::size_t k = 0; k < kTerms; ++k) out[c] += terms[c][k] * t[static_cast<int>(k)];
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
    const auto value = static_cast<double>(v[c]);
    out[c][c] += terms[c][kBent] * (1 + std::log(std::max(value, kDark))) + terms[c][kSquare] * 2 * value;
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

ToneFit fit_tones(const Tensor<float>& render, const Tensor<float>& image, std::span<const double> weight,
                  double hold) {
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
    const ToneVector change = sums.solve(c, hold);
    for (std::size_t k = 0; k < ToneFit::kTerms; ++k) fit.terms[c][k] += change[static_cast<int>(k)];
  }
  return fit;
}

RobustTones fit_tones_robustly(const Tensor<float>& render, const Tensor<float>& image,
                               const std::vector<double>& weight, int passes, double hold) {
  RobustTones out;
  std::vector<double> weights = weight, sizes, &r = out.rest;
  r.resize(3 * weight.size());
  sizes.reserve(r.size());
  for (int pass = 0; pass < passes; ++pass) {
    out.tones = fit_tones(render, image, weights, hold);
    out.toned = out.tones(render);
    sizes.clear();
    for (std::size_t i = 0; i < r.size(); ++i) {
      r[i] = static_cast<double>(image.data[i]) - static_cast<double>(out.toned.data[i]);
      if (weight[i / 3] > 0) sizes.push_back(std::abs(r[i]));
    }
    if (sizes.empty()) return out;
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    out.spread = std::max(kLeastSpread, 1.4826 * *middle);
    for (std::size_t p = 0; p < weights.size(); ++p) {
      const double d2 = r[3 * p] * r[3 * p] + r[3 * p + 1] * r[3 * p + 1] + r[3 * p + 2] * r[3 * p + 2];
      weights[p] = weight[p] / (1 + d2 / (3 * std::pow(kCauchy * out.spread, 2)));
    }
  }
  return out;
}

}  // namespace fieldmark::watermark
