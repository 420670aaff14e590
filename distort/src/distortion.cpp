#include "fieldmark/distort/distortion.h"

#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/engine/tape.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/mirror.h>
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "checks.h"
#include "composition.h"
#include "distortion_names.h"
#include "fieldmark/distort/blur.h"
#include "fieldmark/distort/jpeg444.h"
#include "fieldmark/distort/noise.h"
#include "fieldmark/distort/quantize8.h"
#include "fieldmark/distort/resize_area.h"
#include "fieldmark/distort/rotate.h"
#include "fieldmark/distort/similarity.h"

namespace fieldmark::distort {
namespace {

// RNG counters of one step for one image: (index, step << 40 | i).
struct Draws {
  const CounterRng& rng;
  std::uint64_t index, base;
  std::uint64_t at(Index i) const { return base + static_cast<std::uint64_t>(i); }
  std::vector<float> normal(Index n) const {
    std::vector<float> field(static_cast<std::size_t>(n));
    for (Index i = 0; i < n; i += 4) {
      const auto four = rng.normal4(index, at(i / 4));
      std::copy_n(four.begin(), std::min<Index>(4, n - i), field.begin() + i);
    }
    return field;
  }
  Tensor<float> leaves(const Shape& shape) const {
    return dead_leaves(shape[0], shape[1], [&](Index i) { return rng.uniform4(index, at(i)); });
  }
};

// Its draws come after those of the leaves.
PastedPart pasted_part(const Distortion::Step& step, const Tensor<float>& x, const Draws& draws,
                       std::span<const float> background) {
  constexpr Index kAfterLeaves = Index{1} << 32;
  return quarter_of_object(x, background, step.amount,
                           draws.rng.uniform4(draws.index, draws.at(kAfterLeaves)));
}

template <class F>
Tensor<float> map_values(const Tensor<float>& x, const F& f) {
  Tensor<float> y(x.shape);
  std::transform(x.data.begin(), x.data.end(), y.data.begin(), f);
  return y;
}

Index scaled(Index extent, double factor) {
  return std::max<Index>(1, std::llround(static_cast<double>(extent) * factor));
}

struct Crop {
  Index top, left, height, width;
};

Crop crop_window(const Shape& shape, double fraction, const Draws& draws) {
  const Index h = shape[0], w = shape[1];
  const Index height = scaled(h, std::sqrt(fraction));
  // The width compensates for the rounding of the height, so that the area is exact.
  const Index width = std::min(w, scaled(w, fraction * static_cast<double>(h) / static_cast<double>(height)));
  return {draws.rng.below(h - height + 1, draws.index, draws.at(0)),
          draws.rng.below(w - width + 1, draws.index, draws.at(1)), height, width};
}

Tensor<float> crop(const Tensor<float>& x, const Crop& c) {
  Tensor<float> y({c.height, c.width, 3});
  for (Index i = 0; i < c.height; ++i)
    std::copy_n(x.data.begin() + ((c.top + i) * x.shape[1] + c.left) * 3, c.width * 3,
                y.data.begin() + i * c.width * 3);
  return y;
}

double angle(double amount, const Draws& draws) {
  return amount * (2 * draws.rng.uniform_double(draws.index, draws.base) - 1) * std::numbers::pi / 180;
}

// Hue, saturation and value of Smith 1978 with hue rotated:
// channel n = v - v s max(0, min(k, 4 - k, 1)), k = n + hue/60.
Tensor<float> turn_hue(const Tensor<float>& x, double degrees) {
  Tensor<float> y(x.shape);
  const double turn = degrees / 60 + 12;
  for (Index i = 0; i < x.size(); i += 3) {
    const double r = static_cast<double>(x[i]), g = static_cast<double>(x[i + 1]),
                 b = static_cast<double>(x[i + 2]);
    const double value = std::max({r, g, b}), chroma = value - std::min({r, g, b});
    if (chroma <= 0) {
      std::copy_n(x.data.begin() + i, 3, y.data.begin() + i);
      continue;
    }
    const double sector = value == r   ? (g - b) / chroma
                          : value == g ? 2 + (b - r) / chroma
                                       : 4 + (r - g) / chroma;
    for (Index c = 0; c < 3; ++c) {
      const double k = std::fmod(static_cast<double>(5 - 2 * c) + sector + turn, 6.0);
      y[i + c] = static_cast<float>(value - chroma * std::max(0.0, std::min({k, 4 - k, 1.0})));
    }
  }
  return y;
}

Tensor<float> grey(const Tensor<float>& x) {
  Tensor<float> y(x.shape);
  for (Index i = 0; i < x.size(); i += 3)
    std::fill_n(y.data.begin() + i, 3, 0.299f * x[i] + 0.587f * x[i + 1] + 0.114f * x[i + 2]);
  return y;
}

Tensor<float> scale(const Tensor<float>& x, double factor, ResizeFilter filter) {
  return resize_filtered(x, scaled(x.shape[0], factor), scaled(x.shape[1], factor), filter);
}

// Runs a distortion op on an image.
template <class F>
Tensor<float> run(const Tensor<float>& x, const F& op) {
  Tape<float> tape;
  const Var<float> y = op(tape.constant(x), tape);
  return {y.shape(), std::vector<float>(y.value(), y.value() + y.shape().size())};
}

Tensor<float> apply(const Distortion::Step& step, const Tensor<float>& x, const Draws& draws,
                    std::span<const float> background) {
  const auto a = static_cast<float>(step.amount);
  float parameter = a;
  switch (step.kind) {
    case DistortionKind::noise: {
      const auto field = draws.normal(x.size());
      return run(x, [&](auto v, auto& tape) { return noise(v, tape.constant(&parameter, {1}), field); });
    }
    case DistortionKind::rotation: {
      parameter = static_cast<float>(angle(step.amount, draws));
      return run(x,
                 [&](auto v, auto& tape) { return rotate(v, tape.constant(&parameter, {1}), background); });
    }
    case DistortionKind::scale:
      return run(x, [&](auto v, auto&) {
        return resize_area(v, scaled(x.shape[0], step.amount), scaled(x.shape[1], step.amount));
      });
    case DistortionKind::scale_nearest:
      return scale(x, step.amount, ResizeFilter::nearest);
    case DistortionKind::scale_bilinear:
      return scale(x, step.amount, ResizeFilter::bilinear);
    case DistortionKind::scale_bicubic:
      return scale(x, step.amount, ResizeFilter::bicubic);
    case DistortionKind::scale_lanczos:
      return scale(x, step.amount, ResizeFilter::lanczos);
    case DistortionKind::blur:
      return run(x, [&](auto v, auto& tape) { return blur(v, tape.constant(&parameter, {1})); });
    case DistortionKind::crop:
      return crop(x, crop_window(x.shape, step.amount, draws));
    case DistortionKind::jpeg:
      return jpeg_round_trip(x, static_cast<int>(step.amount));
    case DistortionKind::jpeg444:
      return jpeg444(x, static_cast<int>(step.amount));
    case DistortionKind::webp:
      return webp_round_trip(x, static_cast<int>(step.amount));
    case DistortionKind::h264:
      break;  // rejected by apply_distortion()
    case DistortionKind::gamma:
      return map_values(x, [a](float v) { return std::pow(std::max(v, 0.f), a); });
    case DistortionKind::brightness:
      return map_values(x, [a](float v) { return v * a; });
    case DistortionKind::contrast:
      return map_values(x, [a](float v) { return 0.5f + a * (v - 0.5f); });
    case DistortionKind::stretch:
      return run(x,
                 [&](auto v, auto&) { return resize_area(v, x.shape[0], scaled(x.shape[1], step.amount)); });
    case DistortionKind::greyscale:
      return grey(x);
    case DistortionKind::sepia:
      return sepia(x);
    case DistortionKind::mirror:
      return mirrored(x);
    case DistortionKind::pillarbox:
      return pillarboxed(x);
    case DistortionKind::letterbox:
      return letterboxed(x);
    case DistortionKind::background_black:
      return before_another(x, background, [](Index) { return std::array{0.f, 0.f, 0.f}; });
    case DistortionKind::background_white:
      return before_another(x, background, [](Index) { return std::array{1.f, 1.f, 1.f}; });
    case DistortionKind::background_grey:
      return before_another(x, background, [](Index) { return std::array{0.5f, 0.5f, 0.5f}; });
    case DistortionKind::background_green:
      return before_another(x, background, [](Index) { return std::array{0.1f, 0.7f, 0.2f}; });
    case DistortionKind::background_noise:
      return before_another(x, background, [&](Index p) {
        const auto u = draws.rng.uniform4(draws.index, draws.at(p));
        return std::array{u[0], u[1], u[2]};
      });
    case DistortionKind::background_shapes: {
      const Tensor<float> leaves = draws.leaves(x.shape);
      return before_another(x, background, [&](Index p) {
        return std::array{leaves[3 * p], leaves[3 * p + 1], leaves[3 * p + 2]};
      });
    }
    case DistortionKind::part:
      return pasted(x, background, pasted_part(step, x, draws, background), draws.leaves(x.shape));
    case DistortionKind::caption:
      return captioned(x);
    case DistortionKind::collage:
      return collage(x);
    case DistortionKind::hue:
      return turn_hue(x, step.amount);
  }
  return x;
}

// Returns the source positions of one step; the identity for steps that move no pixel.
PixelMap moved(const Distortion::Step& step, const Tensor<float>& image, const Shape& after,
               const Draws& draws, std::span<const float> background) {
  const Shape& before = image.shape;
  if (step.kind == DistortionKind::part) {
    const PastedPart p = pasted_part(step, image, draws, background);
    const double y = static_cast<double>(p.height) / static_cast<double>(p.to_height),
                 x = static_cast<double>(p.width) / static_cast<double>(p.to_width);
    const auto start = [](Index from, Index to, double per_pixel) {
      return static_cast<double>(from) - 0.5 + (0.5 - static_cast<double>(to)) * per_pixel;
    };
    const auto edge = [](Index line) { return static_cast<double>(line) - 0.5; };
    return {{x, 0, start(p.left, p.to_left, x), 0, y, start(p.top, p.to_top, y)},
            {edge(p.left), edge(p.top), edge(p.left + p.width), edge(p.top + p.height)}};
  }
  const double sy = static_cast<double>(before[0]) / static_cast<double>(after[0]),
               sx = static_cast<double>(before[1]) / static_cast<double>(after[1]);
  if (step.kind == DistortionKind::crop) {
    const Crop c = crop_window(before, step.amount, draws);
    return {{1, 0, static_cast<double>(c.left), 0, 1, static_cast<double>(c.top)}};
  }
  if (step.kind == DistortionKind::rotation) {
    PixelMap map{similarity_matrix(angle(step.amount, draws), 1.0, 0.0, 0.0)};
    const double x = static_cast<double>(before[1] - 1) / 2, y = static_cast<double>(before[0] - 1) / 2;
    const auto centre = map(x, y);
    map.numbers[2] += x - centre[0];
    map.numbers[5] += y - centre[1];
    return map;
  }
  if (step.kind == DistortionKind::mirror) return {{-1, 0, static_cast<double>(before[1] - 1), 0, 1, 0}};
  if (step.kind == DistortionKind::pillarbox || step.kind == DistortionKind::letterbox) {
    const Index left = (after[1] - before[1]) / 2, top = (after[0] - before[0]) / 2;
    return {{1, 0, -static_cast<double>(left), 0, 1, -static_cast<double>(top)}};
  }
  // The map of the upper left copy.
  if (step.kind == DistortionKind::collage) return {{2, 0, 0.5, 0, 2, 0.5}};
  return {{sx, 0, sx / 2 - 0.5, 0, sy, sy / 2 - 0.5}};
}

// Returns the bounds, in the original, of what a later step keeps: those of its corners, which is exact
// without a rotation.
std::array<double, 4> kept_by(const PixelMap& first, const std::array<double, 4>& later) {
  if (!std::isfinite(later[0])) return first.kept;
  std::array<double, 4> out = first.kept;
  std::array<std::array<double, 2>, 4> corner;
  for (std::size_t i = 0; i < 4; ++i) corner[i] = first(later[i % 2 ? 2 : 0], later[i < 2 ? 1 : 3]);
  for (std::size_t a = 0; a < 2; ++a) {
    const auto [low, high] = std::ranges::minmax({corner[0][a], corner[1][a], corner[2][a], corner[3][a]});
    out[a] = std::max(out[a], low);
    out[a + 2] = std::min(out[a + 2], high);
  }
  return out;
}

PixelMap after(const PixelMap& first, const PixelMap& second) {
  const auto &a = first.numbers, &b = second.numbers;
  const auto t = first(b[2], b[5]);
  return {{a[0] * b[0] + a[1] * b[3], a[0] * b[1] + a[1] * b[4], t[0], a[3] * b[0] + a[4] * b[3],
           a[3] * b[1] + a[4] * b[4], t[1]},
          kept_by(first, second.kept)};
}

}  // namespace

std::array<double, 2> PixelMap::operator()(double x, double y) const {
  const auto& m = numbers;
  return {m[0] * x + m[1] * y + m[2], m[3] * x + m[4] * y + m[5]};
}

PixelMap PixelMap::inverse() const {
  const auto& m = numbers;
  const double det = m[0] * m[4] - m[1] * m[3];
  PixelMap back{{m[4] / det, -m[1] / det, 0, -m[3] / det, m[0] / det, 0}};
  const auto t = back(m[2], m[5]);
  back.numbers[2] = -t[0];
  back.numbers[5] = -t[1];
  return back;
}

Tensor<float> apply_distortion(const Distortion& distortion, const Tensor<float>& image,
                               const CounterRng& rng, std::uint64_t index, std::span<const float> background,
                               PixelMap* source) {
  check_colours("distortion", image.shape);
  if (background.size() != 3)
    throw ShapeError("[distortion] background: must have 3 elements, got " +
                     std::to_string(background.size()));
  refuse_clip(distortion);
  const auto round = [](const Tensor<float>& x) {
    return run(x, [](auto v, auto&) { return quantize8(v); });
  };
  Tensor<float> x = image;
  PixelMap map;
  std::uint64_t base = std::uint64_t{distortion.first} << 40;
  for (const auto& step : distortion.steps) {
    const Draws draws{rng, index, base};
    Tensor<float> next = round(apply(step, x, draws, background));
    map = after(map, moved(step, x, next.shape, draws, background));
    x = std::move(next);
    base += std::uint64_t{1} << 40;
  }
  if (source) *source = map;
  return x;
}

}  // namespace fieldmark::distort
