#include <algorithm>

#include "photometric_residual.h"
#include "trainer_shard.h"

// Which pixels of which photographs a step's rays go through.

namespace fieldmark::nerf {
namespace {

constexpr Index kTile = 8;  // pixels along a side, see hard_pixels

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// One of n things, from two uniform numbers: one has 24 bits only.
Index pick(float u, float v, Index n) {
  const double x = (static_cast<double>(u) + static_cast<double>(v) * 0x1.0p-24) * static_cast<double>(n);
  return std::min(static_cast<Index>(x), n - 1);
}

}  // namespace

Index Trainer::all_pixels() const {
  const Camera& camera = data_.views[0].camera;
  return static_cast<Index>(data_.views.size()) * camera.width * camera.height;
}

// Tiles of all photographs one after another, for the pixel at `place` of all photographs one after another.
Index Trainer::tile_of(Index place) const {
  const Index width = data_.views[0].camera.width, height = data_.views[0].camera.height;
  const Index across = (width + kTile - 1) / kTile, down = (height + kTile - 1) / kTile;
  const Index view = place / (width * height), pixel = place % (width * height);
  return (view * down + pixel / width / kTile) * across + pixel % width / kTile;
}

// As choose_rays() has it without a preference; with one, a part of the rays takes the harder of two pixels.
void Trainer::prefer_hard(Index first, Index count, std::span<Index> place) const {
  const auto choices = static_cast<Index>(pixels_.size());
  for (Index i = 0; i < count; ++i) {
    const auto u =
        second_rng_.uniform4(static_cast<std::uint64_t>(steps_), static_cast<std::uint64_t>(first + i));
    if (static_cast<double>(u[2]) >= options_.hard_pixels) continue;
    const Index other =
        pixels_.empty() ? pick(u[0], u[1], all_pixels()) : pixels_[at(pick(u[0], u[1], choices))];
    if (tile_errors_[at(tile_of(other))] > tile_errors_[at(tile_of(place[at(i)]))]) place[at(i)] = other;
  }
}

void Trainer::note_errors(Var<float> rays, Shard& c) const {
  for (Index r = 0; r < static_cast<Index>(c.places.size()); ++r) {
    const float *y = rays.value() + 4 * r, *p = &c.photograph[at(4 * r)], *b = &c.background[at(3 * r)];
    float sum = 0;
    for (Index k = 0; k < 3; ++k) {
      const float e = photometric_residual(y, p, b, k);
      sum += e * e;
    }
    c.errors.emplace_back(tile_of(c.places[at(r)]), sum / 3);
  }
}

void Trainer::choose_rays(Index first, Index count, Shard& c) const {
  const auto step = static_cast<std::uint64_t>(steps_);
  c.rays.resize(count);
  for (auto [buffer, columns] : {std::pair{&c.jitter, 1}, {&c.photograph, 4}, {&c.background, 3}})
    buffer->resize(at(count * columns));
  c.places.resize(at(count));
  std::vector<Index>& place = c.places;
  const Index width = data_.views[0].camera.width, size = width * data_.views[0].camera.height;
  // Where a pixel lies in memory is random: all are asked for before the first is used, and so are the places
  // of those that are listed.
  const Index choices = pixels_.empty() ? all_pixels() : static_cast<Index>(pixels_.size());
  for (Index i = 0; i < count; ++i) {
    const auto u = pixel_rng_.uniform4(step, static_cast<std::uint64_t>(first + i));
    c.jitter[at(i)] = u[2];
    place[at(i)] = pick(u[0], u[1], choices);
    if (!pixels_.empty()) __builtin_prefetch(&pixels_[at(place[at(i)])]);
  }
  if (!pixels_.empty())
    for (Index& p : place) p = pixels_[at(p)];
  if (!tile_errors_.empty()) prefer_hard(first, count, place);
  for (const Index p : place) __builtin_prefetch(data_.views[at(p / size)].rgba.data.data() + 4 * (p % size));
  for (Index i = 0; i < count; ++i) {
    const View& view = data_.views[at(place[at(i)] / size)];
    const Index pixel = place[at(i)] % size, column = pixel % width, row = pixel / width;
    const float xy[2] = {static_cast<float>(column), static_cast<float>(row)};
    c.rays.set(field_.space, i, view.camera, xy);
    std::copy_n(view.rgba.data.data() + 4 * pixel, 4, &c.photograph[at(4 * i)]);
    const auto b = background_rng_.uniform4(step, static_cast<std::uint64_t>(first + i));
    std::copy_n(b.data(), 3, &c.background[at(3 * i)]);
  }
}

}  // namespace fieldmark::nerf
