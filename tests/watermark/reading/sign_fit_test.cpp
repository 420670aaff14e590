#include "sign_fit.h"
#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>

#include <cmath>

#include "blurred.h"
#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr Index kPlane = 40, kPixels = kPlane * kPlane, kCells = 25;

// Returns cells of 8 x 8 pixels, each seen through another one: a pixel's mark comes from two cells, the
// second one fainter or stronger.
Carriers overlapping(float second) {
  const auto u = uniform({kPixels, 6}, 0.5, 1, 1);
  Carriers c{Tensor<float>({kPlane, kPlane, 3}), {0}, {}, {}};
  for (Index p = 0; p < kPixels; ++p) {
    const Index cell = p % kPlane / 8 + 5 * (p / kPlane / 8);
    for (Index k = 0; k < 2; ++k) {
      c.cell.push_back(static_cast<std::int32_t>((cell + 7 * k) % kCells));
      for (Index a = 0; a < 3; ++a) {
        const float part = (k == 0 ? 1 : second) * 0.01f * static_cast<float>(u[6 * p + 3 * k + a]);
        c.part.push_back(part);
        c.whole[3 * p + a] += part;
      }
    }
    c.begin.push_back(static_cast<std::int32_t>(c.cell.size()));
  }
  return c;
}

double sign_of(Index cell) { return cell * cell % 11 < 5 ? 1 : -1; }

// Returns the score of an image with that mark, a blur, and noise of a standard deviation.
MarkScore score_of(const Carriers& c, double deviation, double blur = 0) {
  const auto noise = uniform({kPixels, 3}, -std::sqrt(3.0) * deviation, std::sqrt(3.0) * deviation, 2);
  Tensor<float> seen(c.whole.shape);
  for (Index p = 0; p < kPixels; ++p)
    for (auto e = static_cast<std::size_t>(2 * p); e < static_cast<std::size_t>(2 * p + 2); ++e)
      for (Index a = 0; a < 3; ++a)
        seen[3 * p + a] +=
            static_cast<float>(sign_of(c.cell[e])) * c.part[3 * e + static_cast<std::size_t>(a)];
  seen = blurred(seen, blur);
  const auto precision = static_cast<float>(1 / (deviation * deviation));
  MarkScore s{Tensor<float>(c.whole.shape), Tensor<float>(c.whole.shape, precision), blur,
              std::vector<double>(static_cast<std::size_t>(kPixels), 1)};
  for (Index i = 0; i < seen.size(); ++i) s.score[i] = precision * (seen[i] + static_cast<float>(noise[i]));
  return s;
}

// Returns the pixel marks [cells][3 P] of every cell under the blur.
std::vector<std::vector<double>> carriers_of(const Carriers& c, double blur) {
  std::vector<std::vector<double>> m;
  for (Index cell = 0; cell < kCells; ++cell) {
    Tensor<float> own(c.whole.shape);
    for (std::size_t e = 0; e < c.cell.size(); ++e)
      for (std::size_t a = 0; a < 3; ++a)
        if (c.cell[e] == cell) own.data[3 * (e / 2) + a] += c.part[3 * e + a];
    own = blurred(own, blur);
    m.emplace_back(own.data.begin(), own.data.end());
  }
  return m;
}

// Solves A x = b by elimination, with A [n, n] symmetric positive definite.
std::vector<double> solved(std::vector<std::vector<double>> a, std::vector<double> b) {
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t i = k + 1; i < n; ++i) {
      const double f = a[i][k] / a[k][k];
      for (std::size_t j = k; j < n; ++j) a[i][j] -= f * a[k][j];
      b[i] -= f * b[k];
    }
  for (std::size_t k = n; k-- > 0;) {
    for (std::size_t j = k + 1; j < n; ++j) b[k] -= a[k][j] * b[j];
    b[k] /= a[k][k];
  }
  return b;
}
}  // namespace

TEST_CASE(
    "sign_fit: the signs that a dense solution has, after ten steps each within 2e-2, sharp and blurred") {
  const Carriers c = overlapping(0.8f);
  for (const double blur : {0.0, 1.5}) {
    MarkScore s = score_of(c, 0.02, blur);
    for (std::size_t p = 0; p < 200; ++p) s.on_object[p] = 0;
    const SignFit fit = fit_signs(c, s, kCells);
    const auto m = carriers_of(c, blur);
    std::vector<std::vector<double>> normal(kCells, std::vector<double>(kCells));
    std::vector<double> right(kCells);
    for (std::size_t k = 0; k < kCells; ++k) {
      for (std::size_t i = 0; i < m[k].size(); ++i) {
        if (!(s.on_object[i / 3] > 0)) continue;
        right[k] += m[k][i] * static_cast<double>(s.score.data[i]);
        for (std::size_t l = 0; l < kCells; ++l)
          normal[k][l] += m[k][i] * m[l][i] * static_cast<double>(s.precision.data[i]);
      }
      normal[k][k] += fit.noise;
    }
    const auto want = solved(normal, right);
    for (std::size_t k = 0; k < kCells; ++k) {
      CAPTURE(blur, k, fit.noise);
      CHECK(fit.sign[k] == Approx(std::clamp(want[k], -1.0, 1.0)).margin(2e-2));
    }
  }
}

TEST_CASE("sign_fit: a cell that is seen through a stronger one keeps its sign") {
  const Carriers c = overlapping(3);
  const MarkScore s = score_of(c, 0.003);
  const SignFit fit = fit_signs(c, s, kCells);
  Index alone = 0;  // correct signs of a cell's own sum, in which the other's mark is nine times as large
  for (Index cell = 0; cell < kCells; ++cell) {
    CAPTURE(cell);
    CHECK(fit.sign[static_cast<std::size_t>(cell)] * sign_of(cell) > 0.2);
    double sum = 0;
    for (std::size_t e = 0; e < c.cell.size(); e += 2)
      for (std::size_t a = 0; a < 3; ++a)
        if (c.cell[e] == cell) sum += static_cast<double>(c.part[3 * e + a] * s.score.data[3 * (e / 2) + a]);
    alone += sum * sign_of(cell) > 0;
  }
  CHECK(alone < 20);
}

TEST_CASE("sign_fit: the signs explain a residual that is the mark, and little of one that is noise") {
  const Carriers c = overlapping(0);
  const double clear = fit_signs(c, score_of(c, 1e-4), kCells).explained,
               hidden = fit_signs(c, score_of(c, 1), kCells).explained;
  CAPTURE(clear, hidden);
  CHECK((clear > 0.5 && clear < 1.001));  // lambda takes a part of the mark for noise
  CHECK((hidden >= 0 && hidden < 0.1));
}

TEST_CASE("sign_fit: noise that is alike from pixel to pixel counts for what it is") {
  const Carriers c = overlapping(0);
  const MarkScore rough = score_of(c, 1);
  MarkScore alike = rough;
  alike.score = blurred(rough.score, 3);
  const double power = [&] {
    double a = 0, b = 0;
    for (Index i = 0; i < alike.score.size(); ++i) {
      a += std::pow(static_cast<double>(rough.score[i]), 2);
      b += std::pow(static_cast<double>(alike.score[i]), 2);
    }
    return std::sqrt(a / b);
  }();
  for (float& x : alike.score.data) x *= static_cast<float>(power);
  const double one = fit_signs(c, rough, kCells).noise, many = fit_signs(c, alike, kCells).noise;
  CAPTURE(one, many);
  CHECK((one > 0.4 && one < 2));
  CHECK(many > 10);
}

TEST_CASE("sign_fit: one and two threads give the same bits") {
  const Carriers c = overlapping(0.8f);
  const MarkScore s = score_of(c, 0.02, 1.5);
  const ScopedThreads serial(1);
  const SignFit one = fit_signs(c, s, kCells);
  const ScopedThreads parallel(2);
  const SignFit two = fit_signs(c, s, kCells);
  CHECK(one.sign == two.sign);
  CHECK(one.noise == two.noise);
}

TEST_CASE("sign_fit: without information and noise every sign is 0, not NaN") {
  const Carriers c = overlapping(0.5f);
  MarkScore s = score_of(c, 0.01);
  std::fill(s.precision.data.begin(), s.precision.data.end(), 0.f);
  const SignFit fit = fit_signs(c, s, kCells);
  CHECK(fit.noise == 0);
  CHECK(fit.sign == std::vector<double>(kCells));
}

TEST_CASE("sign_fit: what is not seen has no sign, and shapes that do not fit are named") {
  const Carriers c = overlapping(0.5f);
  MarkScore s = score_of(c, 0.01);
  const SignFit more = fit_signs(c, s, kCells + 3);
  REQUIRE(std::ssize(more.sign) == kCells + 3);
  for (std::size_t cell = kCells; cell < more.sign.size(); ++cell) CHECK(more.sign[cell] == 0);
  std::fill(s.on_object.begin(), s.on_object.end(), 0);
  CHECK(fit_signs(c, s, kCells).sign == std::vector<double>(kCells));
  s.on_object.pop_back();
  CHECK_THROWS_AS(fit_signs(c, s, kCells), ShapeError);
}
