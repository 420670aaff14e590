#include "sign_fit.h"
#include <fieldmark/core/error.h>

#include <algorithm>
#include <numeric>

#include "blurred.h"
#include "ordered_sum.h"

namespace fieldmark::watermark {
namespace {

constexpr Index kElsewhere[][2] = {{11, 7}, {-7, 11}, {-11, -7}, {7, -11}};  // shifts down and right, pixels
constexpr Index kMostChunks = 8;  // each holds a sum for every cell, of tens of thousands
constexpr int kSteps = 10;
constexpr double kRest = 1e-4;  // relative residual at which the iteration ends

using Values = std::vector<double>;

double dot(const Values& a, const Values& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

class Fit {
 public:
  Fit(const Carriers& mark, const MarkScore& score, Index cells)
      : mark_(mark), score_(score), cells_(cells), seen_(blurred(mark.whole, score.blur)) {}

  // sum_p M_c(p) v(p) = sum_p part_c(p) (blur v)(p): blur is symmetric.
  Values onto_cells(const Tensor<float>& v) const {
    const Tensor<float> soft = blurred(v, score_.blur);
    const auto add = [&](Index begin, Index end, Sums& part) {
      for_entries(begin, end, [&](Index p, std::size_t e, std::size_t cell) {
        for (Index a = 0; a < 3; ++a)
          part.values[cell] += static_cast<double>(mark_.part[3 * e + at(a)] * soft[3 * p + a]);
      });
    };
    const Index chunk = std::max(kPixelChunk, pixels() / kMostChunks + 1);
    return ordered_sum(pixels(), Sums{Values(at(cells_))}, add, chunk).values;
  }

  // Computes M_c . W M_d for all c, times the values of all d.
  Values normal(const Values& values) const {
    Tensor<float> v(seen_.shape);
    parallel_for(pixels(), kPixelChunk, [&](Index begin, Index end) {
      for_entries(begin, end, [&](Index p, std::size_t e, std::size_t cell) {
        for (Index a = 0; a < 3; ++a)
          v[3 * p + a] += static_cast<float>(values[cell]) * mark_.part[3 * e + at(a)];
      });
    });
    v = blurred(v, score_.blur);
    for (Index i = 0; i < v.size(); ++i) v[i] *= score_.precision[i] * counted(i / 3);
    return onto_cells(v);
  }

  Tensor<float> counted_score() const {
    Tensor<float> v = score_.score;
    for (Index i = 0; i < v.size(); ++i) v[i] *= counted(i / 3);
    return v;
  }

  // The weighted power of the residual, g^2 / W.
  double power() const {
    return ordered_sum(pixels(), 0.0, [&](Index begin, Index end, double& sum) {
      for (Index i = 3 * begin; i < 3 * end; ++i)
        if (counted(i / 3) > 0 && score_.precision[i] > 0)
          sum += static_cast<double>(score_.score[i] * score_.score[i] / score_.precision[i]);
    });
  }

  double noise() const {
    double found = 0, expected = 0;
    for (const auto& [down, right] : kElsewhere) {
      const Tensor<float> moved = score_from(down, right);
      const Values sums = onto_cells(moved);
      found += dot(sums, sums);
      expected += expected_power(down, right);
    }
    return expected > 0 ? found / expected : 0;
  }

 private:
  struct Sums {
    Values values;
    Sums& operator+=(const Sums& other) {
      for (std::size_t i = 0; i < values.size(); ++i) values[i] += other.values[i];
      return *this;
    }
  };

  Index pixels() const { return std::ssize(mark_.begin) - 1; }
  float counted(Index p) const { return score_.on_object[at(p)] > 0 ? 1.f : 0.f; }

  template <class F>
  void for_entries(Index begin, Index end, F use) const {
    for (Index p = begin; p < end; ++p)
      for (auto e = at(mark_.begin[at(p)]); e < at(mark_.begin[at(p + 1)]); ++e) use(p, e, at(mark_.cell[e]));
  }

  // Returns the pixel `down` and `right` of p if it is on the foreground, else -1.
  Index from(Index p, Index down, Index right) const {
    const Index h = seen_.shape[0], w = seen_.shape[1], y = p / w + down, x = p % w + right;
    return y >= 0 && y < h && x >= 0 && x < w && score_.on_object[at(y * w + x)] > 0 ? y * w + x : -1;
  }

  Tensor<float> score_from(Index down, Index right) const {
    Tensor<float> v(seen_.shape);
    for (Index p = 0; p < v.size() / 3; ++p)
      if (const Index other = from(p, down, right); other >= 0)
        for (Index a = 0; a < 3; ++a) v[3 * p + a] = score_.score[3 * other + a];
    return v;
  }

  // Returns the expected power for independent noise. Assumes that blur weakens a cell's part as it weakens
  // the whole mark.
  double expected_power(Index down, Index right) const {
    return ordered_sum(pixels(), 0.0, [&](Index begin, Index end, double& sum) {
      for_entries(begin, end, [&](Index p, std::size_t e, std::size_t) {
        const Index other = from(p, down, right);
        for (Index a = 0; other >= 0 && a < 3; ++a) {
          const auto part = static_cast<double>(mark_.part[3 * e + at(a)]),
                     whole = static_cast<double>(mark_.whole[3 * p + a]),
                     seen = static_cast<double>(seen_[3 * p + a]);
          if (part != 0)
            sum += part * part / std::max(part * part, whole * whole) * seen * seen *
                   static_cast<double>(score_.precision[3 * other + a]);
        }
      });
    });
  }

  const Carriers& mark_;
  const MarkScore& score_;
  Index cells_;
  Tensor<float> seen_;  // the whole mark under the blur
};

}  // namespace

SignFit fit_signs(const Carriers& mark, const MarkScore& score, Index cells) {
  if (score.score.shape != mark.whole.shape || score.precision.shape != mark.whole.shape ||
      3 * std::ssize(score.on_object) != mark.whole.size())
    throw ShapeError("[fit_signs] score, precision and on_object must fit the mark " +
                     mark.whole.shape.str() + ", got " + score.score.shape.str() + ", " +
                     score.precision.shape.str() + " and " + std::to_string(score.on_object.size()) +
                     " pixels");
  const Fit fit(mark, score, cells);
  SignFit out{Values(at(cells)), fit.noise()};
  const Values slope = fit.onto_cells(fit.counted_score());
  Values rest = slope, way = rest;
  const double first = dot(rest, rest);
  double square = first;
  for (int step = 0; step < kSteps && square > kRest * kRest * first; ++step) {
    Values moved = fit.normal(way);
    for (std::size_t c = 0; c < moved.size(); ++c) moved[c] += out.noise * way[c];
    const double curvature = dot(way, moved);
    if (!(curvature > 0)) break;  // no noise and no information along this direction: nothing more to learn
    const double length = square / curvature;
    for (std::size_t c = 0; c < moved.size(); ++c) {
      out.sign[c] += length * way[c];
      rest[c] -= length * moved[c];
    }
    const double next = dot(rest, rest);
    for (std::size_t c = 0; c < moved.size(); ++c) way[c] = rest[c] + next / square * way[c];
    square = next;
  }
  const double power = fit.power();
  out.explained = power > 0 ? dot(slope, out.sign) / power : 0;
  for (double& s : out.sign) s = std::clamp(s, -1.0, 1.0);
  return out;
}

}  // namespace fieldmark::watermark
