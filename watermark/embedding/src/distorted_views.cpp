#include "distorted_views.h"

#include <fieldmark/distort/affine_warp.h>
#include <fieldmark/distort/blur.h>
#include <fieldmark/distort/noise.h>
#include <fieldmark/distort/quantize8.h>
#include <fieldmark/distort/similarity.h>

#include <algorithm>
#include <numbers>

namespace fieldmark::watermark {
namespace {

constexpr std::uint64_t kOfBatch = 8 * 64;  // index of a whole batch's draws, after those of 64 images

double blend(double from, double to, double fraction) { return from + (to - from) * fraction; }

}  // namespace

DistortedViews::DistortedViews(const Owner& owner, std::span<const CachedView> views,
                               const EmbedDistortions& distortions, Index batch, std::uint64_t seed)
    : owner_(owner),
      views_(views),
      distortions_(distortions),
      batch_(batch),
      choice_rng_(seed, 11),
      noise_rng_(seed, 13),
      shift_rng_(seed, 14) {}

TrainingImage DistortedViews::draw(Index step, Index image, Tape<float>& tape) const {
  const float u =
      choice_rng_.uniform4(static_cast<std::uint64_t>(step), 8 * static_cast<std::uint64_t>(image))[0];
  const Index views = std::ssize(views_);
  return draw_of(std::min(static_cast<Index>(u * static_cast<float>(views)), views - 1), step, image, tape);
}

TrainingImage DistortedViews::draw_of(Index view, Index step, Index image, Tape<float>& tape) const {
  const EmbedDistortions& d = distortions_;
  const auto s = static_cast<std::uint64_t>(step), i = static_cast<std::uint64_t>(image);
  const auto u = [&](std::uint64_t k) { return choice_rng_.uniform4(s, 8 * i + k); };
  const auto a = u(0), b = u(1), c = u(2);
  TrainingImage p{.view = view, .step = step};
  const std::uint64_t place = this->place(step, image);
  const auto often = [](float x) { return x < 2.f / 3; };
  // Unless distortions are mixed, the whole batch takes one of none, rotation, zoom, blur and noise.
  const int only = d.mixed ? 0 : static_cast<int>(5 * choice_rng_.uniform4(s, kOfBatch)[0]);
  const auto through = [&](int kind, bool drawn) { return d.mixed ? drawn : kind == only; };
  const bool turned = through(1, often(a[1])), zoomed = through(2, often(a[3]));
  const double angle =
      turned ? blend(-d.rotation, d.rotation, static_cast<double>(a[2])) * 3.14159265358979 / 180 : 0;
  const double zoom = zoomed ? blend(d.zoom_out, d.zoom_in, static_cast<double>(b[0])) : 1;
  // Draws a window at a random place inside the image; a small shift where the whole image is visible.
  const PatchSize patch = owner_.options().patch();
  const auto size = static_cast<double>(patch.height),
             height = static_cast<double>(views_[at(p.view)].height);
  const double room = 0.5 * std::max(zoom - 1, 0.04);
  const double sx = blend(-room, room, static_cast<double>(b[1])) * static_cast<double>(patch.width),
               sy = blend(-room, room, static_cast<double>(b[2])) * size;
  p.warped = turned || zoomed || height != size;
  p.warp = distort::similarity_matrix(static_cast<float>(angle), static_cast<float>(zoom * size / height),
                                      static_cast<float>(sx), static_cast<float>(sy));
  const float blur = through(3, b[3] < 1.f / 3) ? static_cast<float>(d.blur) * c[0] : 0.f,
              noise = through(4, often(c[1])) ? static_cast<float>(d.noise) * c[2] : 0.f;
  p.positions = shifted_positions(tape, p.view, place);
  p.distort = [this, place, blur, noise, warped = p.warped, warp = p.warp](Var<float> x) {
    return distorted(x, place, warped, warp, blur, noise);
  };
  return p;
}

// Returns the samples of a view, each moved by a random shift.
float* DistortedViews::shifted_positions(Tape<float>& tape, Index view, std::uint64_t place) const {
  const CachedView& v = views_[at(view)];
  const Index samples = static_cast<Index>(v.weight.size());
  float* x = tape.scratch(3 * samples);
  const auto beta = static_cast<float>(distortions_.sample_shift);
  for (Index k = 0; k < samples; ++k) {
    const auto z = shift_rng_.uniform4(place, static_cast<std::uint64_t>(k));
    // Draws a uniform number of variance 1 per axis: the distribution of so small a shift does not matter.
    for (Index a = 0; a < 3; ++a)
      x[3 * k + a] = v.position[at(3 * k + a)] + beta * 3.4641f * (z[at(a)] - 0.5f);
  }
  return x;
}

Var<float> DistortedViews::distorted(Var<float> image, std::uint64_t place, bool warped,
                                     const std::array<float, 6>& warp, float blur, float noise) const {
  Tape<float>& tape = image.tape();
  const float level = nerf::background_value(owner_.field.background);
  const float background[3] = {level, level, level};
  const auto number = [&](float value) {
    float* to = tape.scratch(1);
    *to = value;
    return tape.constant(to, {1});
  };
  if (warped) {
    float* matrix = tape.scratch(6);
    std::copy(warp.begin(), warp.end(), matrix);
    const PatchSize size = owner_.options().patch();
    image = distort::affine_warp(image, tape.constant(matrix, {6}),
                                 {.height = size.height, .width = size.width, .background = background});
  }
  if (blur > 0) image = distort::blur(image, number(blur));
  if (noise > 0) {
    const Index n = image.shape().size();
    float* field = tape.scratch(n + 3);
    for (Index i = 0; i < n; i += 4) {
      const auto z = noise_rng_.normal4(place, static_cast<std::uint64_t>(i));
      std::copy_n(z.data(), std::min<Index>(4, n - i), field + i);
    }
    image = distort::noise(image, number(noise), std::span<const float>(field, at(n)));
  }
  return distort::quantize8(image);
}

}  // namespace fieldmark::watermark
