#include "jpeg_score.h"
#include <fieldmark/core/error.h>
#include <fieldmark/distort/jpeg444.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/image.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "blurred.h"
#include "jpeg_trace.h"
#include "support/catch.h"
#include "watermark/reading/jpeg_view.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

// Returns a faint pattern at the scale of a mark, with the given rms amplitude.
Tensor<float> pattern(float amplitude) {
  const CounterRng rng(9, 2);
  Tensor<float> x({kJpegViewHeight, kJpegViewWidth, 3});
  for (Index p = 0; p < kJpegViewHeight * kJpegViewWidth; ++p) {
    const Index patch = p / kJpegViewWidth / 3 * kJpegViewWidth + p % kJpegViewWidth / 3;
    const float a = amplitude * rng.normal2(static_cast<std::uint64_t>(patch))[0];
    for (Index c = 0; c < 3; ++c) x[3 * p + c] = a * (c == 2 ? 0.5f : 1.f);
  }
  return x;
}

Tensor<float> sum(const Tensor<float>& a, const Tensor<float>& b, float sign) {
  Tensor<float> out = a;
  for (Index i = 0; i < out.size(); ++i) out[i] += sign * b[i];
  return quantize8(out);
}

const std::vector<double> kEverywhere(static_cast<std::size_t>(kJpegViewHeight* kJpegViewWidth), 1.0);

// Expected square of score times mark.
double information_of(const JpegScore& s, const Tensor<float>& mark) {
  double sum = 0;
  for (Index i = 0; i < mark.size(); ++i) sum += static_cast<double>(s.precision[i] * mark[i] * mark[i]);
  return sum;
}

// How many 8-row strips get the right sign: from the score's product with the mark, and from a plain
// difference.
struct Right {
  int score = 0, difference = 0, of = 0;
};

Right strips_right(int quality, float amplitude) {
  Right right;
  for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
    const Tensor<float> base = view_image(0.03f, seed), mark = pattern(amplitude);
    const CounterRng rng(seed, 3);
    const auto sign = [&](Index y, Index x) {
      return rng.uniform4(static_cast<std::uint64_t>(y / 8 * 10 + x / 34))[0] < 0.5f ? -1.f : 1.f;
    };
    Tensor<float> marked = base;
    for (Index i = 0; i < marked.size(); ++i)
      marked[i] += mark[i] * sign(i / 3 / kJpegViewWidth, i / 3 % kJpegViewWidth);
    const Tensor<float> seen = jpeg_round_trip(quantize8(marked), quality);
    const JpegScore s = JpegImage(seen, kEverywhere, *find_jpeg(seen)).score(base, mark);
    for (Index y = 0; y < kJpegViewHeight; y += 8)
      for (Index x = 0; x < kJpegViewWidth; x += 34) {
        double ours = 0, plain = 0;
        for (Index i = 0; i < 8 * 34 * 3; ++i) {
          const Index p = 3 * ((y + i / 3 / 34) * kJpegViewWidth + x + i / 3 % 34) + i % 3;
          ours += static_cast<double>(mark[p] * s.score[p]);
          plain += static_cast<double>(mark[p] * (seen[p] - base[p]));
        }
        const double truth = static_cast<double>(sign(y, x));
        right.score += ours * truth > 0;
        right.difference += plain * truth > 0;
        ++right.of;
      }
  }
  return right;
}

}  // namespace

TEST_CASE("jpeg_score: an image of which edges were cut off is read from its first whole block on") {
  const Tensor<float> base = view_image(0.03f, 5), mark = pattern(0.01f);
  const Tensor<float> seen = jpeg_round_trip(sum(base, mark, 1), 30);
  constexpr Index kLeft = 21, kTop = 5;
  const auto cut = [&](const Tensor<float>& x) {
    Tensor<float> out({kJpegViewHeight - kTop, kJpegViewWidth - kLeft, 3});
    for (Index y = 0; y < kJpegViewHeight - kTop; ++y)
      std::copy_n(&x[3 * ((y + kTop) * kJpegViewWidth + kLeft)], 3 * (kJpegViewWidth - kLeft),
                  &out[3 * y * (kJpegViewWidth - kLeft)]);
    return out;
  };
  CHECK_FALSE(find_jpeg(cut(seen)));
  const auto trace = find_jpeg(cut(seen), kLeft, kTop);
  REQUIRE(trace.has_value());
  CHECK(trace->quality == 30);
  CHECK(trace->left == 11);
  CHECK(trace->top == 11);
  const std::vector<double> object(
      static_cast<std::size_t>((kJpegViewHeight - kTop) * (kJpegViewWidth - kLeft)), 1.0);
  const JpegScore whole = JpegImage(seen, kEverywhere, *find_jpeg(seen)).score(base, mark);
  const JpegScore part = JpegImage(cut(seen), object, *trace).score(cut(base), cut(mark));
  double both = 0, of_part = 0, of_whole = 0, outside = 0;
  for (Index y = 0; y < kJpegViewHeight - kTop; ++y)
    for (Index x = 0; x < kJpegViewWidth - kLeft; ++x)
      for (Index c = 0; c < 3; ++c) {
        const auto a = static_cast<double>(part.score[3 * (y * (kJpegViewWidth - kLeft) + x) + c]),
                   b = static_cast<double>(whole.score[3 * ((y + kTop) * kJpegViewWidth + x + kLeft) + c]);
        if (y < 11 || x < 11) outside += std::abs(a);
        if (y < 11 || x < 11) continue;
        both += a * b, of_part += a * a, of_whole += b * b;
      }
  CHECK(outside == 0);
  CHECK(both > 0.95 * std::sqrt(of_part * of_whole));  // deviations are fitted to other blocks
  CHECK_FALSE(find_jpeg(Tensor<float>({8, 8, 3}), 1, 1));
  CHECK_THROWS_WITH(find_jpeg(seen, -1, 0), "[find_jpeg] left and top must be at least 0, got -1 and 0");
}

TEST_CASE("jpeg_log_likelihood: the render that was compressed is likelier than one in other tones or blur") {
  const Tensor<float> base = view_image(0.03f, 6), seen = jpeg_round_trip(base, 10);
  const JpegTrace trace{.quality = 10, .subsampled = true};
  const JpegImage image(seen, kEverywhere, trace);
  const double truth = image.log_likelihood(base);
  // An object of few blocks is judged by all of them.
  std::vector<double> few(kEverywhere.size(), 0);
  for (std::size_t p = 0; p < few.size(); ++p)
    if (p % kJpegViewWidth < 16) few[p] = 1;
  const JpegImage narrow(seen, few, trace);
  CHECK(narrow.log_likelihood(base) > narrow.log_likelihood(blurred(base, 0.8)));
  CHECK(std::isfinite(truth));
  CHECK(truth < 0);
  Tensor<float> toned = base;
  for (float& x : toned.data) x = 0.95f * x + 0.02f;
  CHECK(truth > image.log_likelihood(toned) + 10);
  CHECK(truth > image.log_likelihood(blurred(base, 0.8)) + 10);
}

TEST_CASE("jpeg_score: the precision is of the noise, whatever the mark's power") {
  const Tensor<float> base = view_image(0.03f, 8), mark = pattern(0.01f);
  const Tensor<float> seen = jpeg_round_trip(sum(base, mark, 1), 40);
  const JpegTrace trace{.quality = 40, .subsampled = true};
  Tensor<float> twice = mark, uneven = mark;
  for (float& x : twice.data) x *= 2;
  // Pixels that hardly change are seen no better than those around them.
  for (Index p = 0; p < mark.size() / 3; p += 7)
    for (Index i = 3 * p; i < 3 * p + 3; ++i) uneven[i] *= 1e-3f;
  const JpegImage image(seen, kEverywhere, trace);
  const JpegScore once = image.score(base, mark);
  CHECK(image.score(base, twice).precision.data == once.precision.data);
  CHECK(information_of(once, mark) > 0);
  const JpegScore other = image.score(base, uneven);
  for (Index i = 0; i < mark.size(); ++i) REQUIRE(other.precision[i] < 4 * once.precision[i]);
  const JpegScore none = image.score(base, Tensor<float>(mark.shape));
  CHECK(std::ranges::all_of(none.precision.data, [](float x) { return x == 0; }));
}

TEST_CASE("jpeg_score: reads faint signs that a plain difference does not") {
  const Right right = strips_right(50, 0.0012f);
  CAPTURE(right.score, right.difference, right.of);
  CHECK(right.score > right.of * 75 / 100);  // measured 170 against 141 of 208
  CHECK(right.score > right.difference + right.of * 8 / 100);
}

TEST_CASE("jpeg_score: the score is the gradient of the log-likelihood in the render's pixels") {
  const Tensor<float> base = view_image(0.03f, 7), mark = pattern(0.01f);
  for (const bool subsampled : {true, false}) {
    const Tensor<float> marked = sum(base, mark, 1);
    const Tensor<float> seen = subsampled ? jpeg_round_trip(marked, 60) : distort::jpeg444(marked, 60);
    std::vector<double> object(kEverywhere.size(), 0);  // of too few blocks for a sample
    for (std::size_t p = 0; p < object.size(); ++p)
      if (p % kJpegViewWidth < 64) object[p] = 1;
    const JpegImage image(seen, object, {.quality = 60, .subsampled = subsampled});
    const JpegScore s = image.score(base, mark);
    Tensor<float> up = base, down = base;
    double slope = 0;
    for (Index i = 0; i < base.size(); ++i) {
      up[i] += 1e-8f * s.score[i];
      down[i] -= 1e-8f * s.score[i];
      slope += static_cast<double>((up[i] - down[i]) * s.score[i]);
    }
    const double want = image.log_likelihood(up) - image.log_likelihood(down);
    CAPTURE(subsampled, slope, want);
    CHECK(want > 0);
    CHECK(std::abs(slope - want) < 0.01 * want);
  }
}

TEST_CASE("jpeg_score: leans to no sign without a mark") {
  const Tensor<float> base = view_image(0.03f, 7), mark = pattern(0.01f);
  const Tensor<float> seen = jpeg_round_trip(sum(base, mark, 1), 60);
  const JpegTrace trace = *find_jpeg(seen);
  const auto along = [&](const JpegScore& s) {
    double out = 0;
    for (Index i = 0; i < mark.size(); ++i) out += static_cast<double>(s.score[i] * mark[i]);
    return out;
  };
  const JpegScore unmarked = JpegImage(jpeg_round_trip(base, 60), kEverywhere, trace).score(base, mark);
  const double information = information_of(unmarked, mark);
  CHECK(information > 0);
  CHECK(std::abs(along(unmarked)) < 4 * std::sqrt(information));
  CHECK(along(JpegImage(seen, kEverywhere, trace).score(base, mark)) > 0);
  CHECK(along(JpegImage(jpeg_round_trip(sum(base, mark, -1), 60), kEverywhere, trace).score(base, mark)) < 0);
}

TEST_CASE("jpeg_score: says nothing off the object, and the same for one and two threads") {
  const Tensor<float> base = view_image(0.03f, 8), mark = pattern(0.01f);
  const Tensor<float> seen = jpeg_round_trip(sum(base, mark, 1), 40);
  std::vector<double> object(kEverywhere.size(), 0);
  for (std::size_t p = 0; p < object.size(); ++p)
    if (p % kJpegViewWidth < 64) object[p] = 1;
  const JpegTrace trace{.quality = 40, .subsampled = true};
  Tensor<float> scores[2], precisions[2];
  double likelihoods[2];
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    JpegScore s = JpegImage(seen, object, trace).score(base, mark);
    scores[n - 1] = std::move(s.score);
    precisions[n - 1] = std::move(s.precision);
    likelihoods[n - 1] = JpegImage(seen, object, trace).log_likelihood(base);
  }
  CHECK(scores[0].data == scores[1].data);
  CHECK(precisions[0].data == precisions[1].data);
  CHECK(likelihoods[0] == likelihoods[1]);
  double left = 0, right = 0;
  for (Index i = 0; i < seen.size(); ++i)
    (i / 3 % kJpegViewWidth < 64 ? left : right) += static_cast<double>(std::abs(scores[0][i]));
  CHECK(left > 0);
  CHECK(right == 0);
}

TEST_CASE("jpeg_score: errors name what is wrong") {
  const Tensor<float> x({16, 16, 3}), other({16, 8, 3});
  const std::vector<double> object(256, 1.0);
  CHECK_THROWS_AS(find_jpeg(Tensor<float>({16, 16})), ShapeError);
  CHECK_THROWS_WITH(JpegImage(x, object, {50, true}).score(other, x),
                    "[jpeg_image] render must have the image's shape [16, 16, 3], got [16, 8, 3]");
  CHECK_THROWS_WITH(JpegImage(x, object, {50, true}).score(x, other),
                    "[jpeg_image] mark must have the image's shape [16, 16, 3], got [16, 8, 3]");
  CHECK_THROWS_AS(JpegImage(x, object, {0, true}).score(x, x), ValueError);
  CHECK_THROWS_WITH(JpegImage(x, object, {50, true}).log_likelihood(other),
                    "[jpeg_image] render must have the image's shape [16, 16, 3], got [16, 8, 3]");
  CHECK_THROWS_WITH(JpegImage(x, object, {50, true, 0, 16}),
                    "[jpeg_image] left and top must be inside image [16, 16, 3], got 0 and 16");
  CHECK_THROWS_WITH(JpegImage(x, std::vector<double>(255, 1.0), {50, true}),
                    "[jpeg_image] object must have a value for each pixel of image [16, 16, 3], got 255");
  CHECK_THROWS_AS(JpegImage(x, object, {101, true}).log_likelihood(x), ValueError);
}

TEST_CASE("jpeg_log_likelihood: of a sample of many blocks, the same for one and two threads") {
  Tensor<float> base({200, 200, 3});
  const CounterRng rng(4, 4);
  for (Index i = 0; i < base.size(); ++i)
    base[i] = 0.5f + 0.2f * std::sin(0.01f * static_cast<float>(i % 611)) +
              0.05f * rng.normal2(static_cast<std::uint64_t>(i))[0];
  const Tensor<float> seen = jpeg_round_trip(quantize8(base), 50);
  const std::vector<double> object(200 * 200, 1.0);
  double found[2], blurry[2];
  for (const int n : {1, 2}) {
    const ScopedThreads scope(n);
    const JpegImage image(seen, object, {.quality = 50, .subsampled = true});
    found[n - 1] = image.log_likelihood(base);
    blurry[n - 1] = image.log_likelihood(blurred(base, 1));
  }
  CHECK(found[0] == found[1]);
  CHECK(blurry[0] == blurry[1]);
  CHECK(found[0] > blurry[0]);
}
