#include <fieldmark/engine/resize.h>
#include <fieldmark/watermark/geometry_reader.h>
#include <fieldmark/watermark/jpeg_score.h>
#include <fieldmark/watermark/tone_fit.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "blurred.h"

namespace fieldmark::watermark {
namespace {

constexpr Index kByPlaces = 3, kByPicture = 3, kByPart = 6;  // cameras that are tried
constexpr AlignmentStage kCoarse[] = {{.size = 48, .blur = 1.5, .steps = 6}};
constexpr AlignmentStage kFine[] = {{.size = 96, .blur = 1.2, .steps = 10},
                                    {.size = 200, .blur = 1.2, .steps = 6}};
constexpr Index kLargest = 512;        // longer side at which evidence is taken, pixels
constexpr double kFarFromLeast = 1.2;  // of what is left: no larger blur is tried then
constexpr double kBlurs[] = {0, 0.4, 0.6, 0.8, 1, 1.25, 1.5, 2, 2.5, 3};  // deviations tried, pixels
constexpr double kAround = 4;           // deviation of the window in which the noise is measured, pixels
constexpr float kLeastNoise = 1.2e-6f;  // variance of rounding to 8 bits

constexpr Index kElsewhere[][2] = {{11, 7}, {-7, 11}, {-11, -7}, {7, -11}};  // down and right, pixels

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// What the mark of sign +1 adds to each pixel.
Tensor<float> carriers(const Owner& owner, const CachedView& v) {
  Tensor<float> out({v.height, v.width, 3});
  const auto n = static_cast<Index>(v.weight.size());
  Tape<float> tape;
  const Var<float> carrier =
      owner.mark->carrier(Params<float>(owner.params, nullptr), tape.constant(v.position.data(), {n, 3}),
                          tape.constant(v.colour.data(), {n, 3}));
  const auto gain = static_cast<float>(owner.gain);
  for (Index p = 0; p < v.height * v.width; ++p)
    for (std::int32_t k = v.sample_begin[at(p)]; k < v.sample_begin[at(p + 1)]; ++k)
      for (Index a = 0; a < 3; ++a) {
        const float c = v.colour[3 * at(k) + at(a)], add = gain * carrier.value()[3 * Index{k} + a];
        out[3 * p + a] +=
            v.weight[at(k)] * 0.5f * (std::clamp(c + add, 0.f, 1.f) - std::clamp(c - add, 0.f, 1.f));
      }
  return out;
}

// The owner's unmarked view as a picture shows it, under the blur and the tones that leave least, and what is
// left.
struct Shown {
  Tensor<float> render, rest;
  double blur = 0, left = 0;
};

Shown shown_with(const Tensor<float>& picture, const Tensor<float>& base, const std::vector<double>& object,
                 double blur) {
  Shown s{.render = blurred(base, blur), .rest = Tensor<float>(picture.shape), .blur = blur};
  const ToneFit tones = fit_tones(s.render, picture, object);
  for (Index i = 0; i < s.rest.size(); ++i) {
    s.render[i] = static_cast<float>(tones.at(i % 3, static_cast<double>(s.render[i])));
    s.rest[i] = picture[i] - s.render[i];
    s.left += object[at(i / 3)] * static_cast<double>(s.rest[i] * s.rest[i]);
  }
  return s;
}

Shown shown(const Tensor<float>& picture, const Tensor<float>& base, const std::vector<double>& object) {
  Shown best = shown_with(picture, base, object, kBlurs[0]);
  for (const double blur : std::span(kBlurs).subspan(1)) {
    Shown s = shown_with(picture, base, object, blur);
    if (s.left < best.left)
      best = std::move(s);
    else if (s.left > kFarFromLeast * best.left)
      break;
  }
  return best;
}

// What of a picture is multiplied with the mark, pixel by pixel, and what that may be expected to give.
struct Compared {
  Tensor<float> rest, mark, information;  // [H, W, 3]
  std::vector<double> object;             // [P] 1 where the field is seen
};

// Both in deviations of the noise around each pixel.
void compare_differences(const Shown& seen, Compared& c) {
  c.rest = seen.rest;
  Tensor<float> power = c.rest;
  for (float& x : power.data) x *= x;
  power = blurred(power, kAround);
  c.information = Tensor<float>(c.rest.shape);
  for (Index i = 0; i < power.size(); ++i) {
    const float deviation = std::sqrt(std::max(power[i], 0.f) + kLeastNoise);
    c.rest[i] /= deviation;
    c.mark[i] /= deviation;
    c.information[i] = c.mark[i] * c.mark[i];
  }
}

Compared compare(const Tensor<float>& picture, const CachedView& view, const Tensor<float>& mark,
                 const std::optional<JpegTrace>& jpeg) {
  Compared c;
  for (const float opacity : view.opacity.data) c.object.push_back(opacity > 0.5f ? 1 : 0);
  const Shown seen = shown(picture, view.base, c.object);
  c.mark = blurred(mark, seen.blur);
  if (!jpeg) {
    compare_differences(seen, c);
    return c;
  }
  JpegScore score = jpeg_score(picture, seen.render, c.mark, c.object, *jpeg);
  if (seen.blur > 0) {  // steps take fine detail away as blur does
    JpegScore sharp =
        jpeg_score(picture, shown_with(picture, view.base, c.object, 0).render, mark, c.object, *jpeg);
    if (sharp.log_likelihood > score.log_likelihood) {
      score = std::move(sharp);
      c.mark = mark;
    }
  }
  c.rest = std::move(score.score);
  c.information = std::move(score.information);
  return c;
}

// Of the rest with the mark of each cell, the rest taken from so many pixels further down and right.
struct Correlation {
  std::vector<double> sum, information;  // [cells] information: where they met
};

Correlation correlate(const Compared& c, const std::vector<std::int32_t>& cell, Index cells, Index down,
                      Index right) {
  Correlation out{std::vector<double>(at(cells)), std::vector<double>(at(cells))};
  const Index h = c.rest.shape[0], w = c.rest.shape[1];
  for (Index y = std::max<Index>(0, -down); y < h - std::max<Index>(0, down); ++y)
    for (Index x = std::max<Index>(0, -right); x < w - std::max<Index>(0, right); ++x) {
      const Index p = y * w + x, other = (y + down) * w + x + right;
      if (cell[at(p)] < 0 || !(c.object[at(other)] > 0)) continue;
      for (Index a = 0; a < 3; ++a) {
        out.sum[at(cell[at(p)])] +=
            static_cast<double>(c.mark[3 * p + a]) * static_cast<double>(c.rest[3 * other + a]);
        out.information[at(cell[at(p)])] += static_cast<double>(c.information[3 * p + a]);
      }
    }
  return out;
}

}  // namespace

const char* reading_name(ReadingKind kind) { return kind == ReadingKind::geometry ? "geometry" : "blind"; }

GeometryReader::GeometryReader(const Owner& owner, const CameraSearchOptions& search)
    : owner_(owner), blind_(owner), search_(owner, search), aligner_(owner.field), renderer_(owner.field) {}

std::vector<double> GeometryReader::evidence_at(const Tensor<float>& picture, const nerf::Camera& camera) {
  const CachedView view = cache_view(renderer_, owner_.field, camera);
  const Compared c = compare(picture, view, carriers(owner_, view), find_jpeg(picture));
  std::vector<std::int32_t> cell(c.object.size(), -1);
  for (std::size_t p = 0; p < cell.size(); ++p)
    if (view.sample_begin[p] < view.sample_begin[p + 1])
      cell[p] = owner_.cells.at(&view.position[3 * at(view.sample_begin[p])]);
  std::vector<double> sums = correlate(c, cell, owner_.cells.count(), 0, 0).sum;

  // Differences from elsewhere on the object have nothing to do with the mark here, but are as alike from
  // pixel to pixel: how much larger their sums are than those of independent ones says what a sum is worth.
  double found = 0, expected = 0;
  for (const auto& [dy, dx] : kElsewhere) {
    const Correlation other = correlate(c, cell, owner_.cells.count(), dy, dx);
    for (std::size_t k = 0; k < other.sum.size(); ++k) {
      found += other.sum[k] * other.sum[k];
      expected += other.information[k];
    }
  }
  const double worth = found > 0 ? expected / found : 0;
  for (double& s : sums) s = std::tanh(0.5 * worth * s);
  return sums;
}

PictureReading GeometryReader::read(const Tensor<float>& picture) {
  PictureReading reading;
  SeenPlaces places;
  reading.blind = blind_.evidence(picture, &places);
  const Tensor<float> whole = opaque_picture(picture, nerf::background_value(owner_.field.background));
  const Index h = whole.shape[0], w = whole.shape[1];
  GeometryReading& g = reading.geometry;
  std::vector<nerf::Camera> starts = search_.find(places, h, w, kByPlaces);
  const std::vector<nerf::Camera> others = search_.find(whole, kByPicture);
  starts.insert(starts.end(), others.begin(), others.end());
  const auto try_all = [&](const std::vector<nerf::Camera>& cameras) {
    for (const nerf::Camera& start : cameras) {
      const Alignment a = aligner_.align(whole, start, kCoarse);
      if (a.agreement > g.agreement) {
        g.agreement = a.agreement;
        g.camera = a.camera;
      }
    }
  };
  try_all(starts);
  if (g.agreement < kLeastAgreement) try_all(search_.find_part(whole, kByPart));
  if (g.agreement < 0) return reading;
  const Alignment a = aligner_.align(whole, g.camera, kFine);
  g.camera = a.camera;
  g.agreement = a.agreement;
  const nerf::Camera used = g.camera.scaled(std::min(kLargest, std::max(h, w)));
  g.evidence = evidence_at(resize_area(whole, used.height, used.width), used);
  double ours = 0, theirs = 0;
  for (std::size_t c = 0; c < g.evidence.size(); ++c) {
    ours += g.evidence[c] * g.evidence[c];
    theirs += reading.blind[c] * reading.blind[c];
  }
  if (ours > 0 && theirs > 0)
    for (double& s : g.evidence) s *= std::sqrt(theirs / ours);
  if (g.agreement >= kLeastAgreement) reading.chosen = ReadingKind::geometry;
  return reading;
}

}  // namespace fieldmark::watermark
