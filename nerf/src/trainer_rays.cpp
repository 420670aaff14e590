#include <algorithm>
#include <array>

#include <fieldmark/nerf/photometric_loss.h>

#include "trainer_shard.h"

// Chooses the pixels that the rays of a step go through.

namespace fieldmark::nerf {
namespace {

constexpr Index kErrorTile = 8;                                        // pixels along a side, see hard_pixels
constexpr Index kMostParts = kMostSupersampling * kMostSupersampling;  // of a pixel

// Returns a uniform integer below n from two uniform floats, because one has only 24 bits.
Index pick(float u, float v, Index n) {
  const double x = (static_cast<double>(u) + static_cast<double>(v) * 0x1.0p-24) * static_cast<double>(n);
  return std::min(static_cast<Index>(x), n - 1);
}

}  // namespace

Index Trainer::all_pixels() const {
  const Camera& camera = data_.views[0].camera;
  return static_cast<Index>(data_.views.size()) * camera.width * camera.height;
}

// Returns the index of the tile that holds a pixel; tiles and pixels are numbered across all images.
Index Trainer::tile_of(Index place) const {
  const Index width = data_.views[0].camera.width, height = data_.views[0].camera.height;
  const Index across = (width + kErrorTile - 1) / kErrorTile, down = (height + kErrorTile - 1) / kErrorTile;
  const Index view = place / (width * height), pixel = place % (width * height);
  return (view * down + pixel / width / kErrorTile) * across + pixel % width / kErrorTile;
}

// Replaces a share of the pixels, see TrainOptions::hard_pixels, by the harder of two candidates.
void Trainer::prefer_hard(Index first, Index count, std::span<Index> place) const {
  const auto choices = static_cast<Index>(pixels_.size());
  for (Index i = 0; i < count; ++i) {
    const auto u =
        second_rng_.uniform4(static_cast<std::uint64_t>(steps()), static_cast<std::uint64_t>(first + i));
    if (static_cast<double>(u[2]) >= options_.hard_pixels) continue;
    const Index other =
        pixels_.empty() ? pick(u[0], u[1], all_pixels()) : pixels_[at(pick(u[0], u[1], choices))];
    if (tile_errors_[at(tile_of(other))] > tile_errors_[at(tile_of(place[at(i)]))]) place[at(i)] = other;
  }
}

void Trainer::note_errors(Var<float> rays, Shard& c) const {
  for (Index r = 0; r < static_cast<Index>(c.places.size()); ++r) {
    const float *y = rays.value() + 4 * r, *p = &c.truth[at(4 * r)], *b = &c.background[at(3 * r)];
    float sum = 0;
    for (Index k = 0; k < 3; ++k) {
      const float e = photometric_residual(y, p, b, k);
      sum += e * e;
    }
    c.errors.emplace_back(tile_of(c.places[at(r)]), sum / 3);
  }
}

Index Trainer::rays_along_pixel() const {
  return steps() < options_.supersample_after ? 1 : field_.options().supersampling;
}

// Sets one ray through the centre of each pixel, or one at random in each of its parts, row by row; each is
// displaced by the pixel's offset.
void Trainer::aim(Index first, Shard& c) const {
  const auto step = static_cast<std::uint64_t>(steps());
  const Index k = rays_along_pixel();
  const Index width = data_.views[0].camera.width, size = width * data_.views[0].camera.height;
  std::array<float, 2 * kMostParts> xy{};
  for (Index i = 0; i < std::ssize(c.places); ++i) {
    const Index pixel = c.places[at(i)] % size;
    float column = static_cast<float>(pixel % width), row = static_cast<float>(pixel / width);
    if (const auto& offsets = data_.views[at(c.images[at(i)])].offsets)
      column += (*offsets)[at(pixel)][0], row += (*offsets)[at(pixel)][1];
    for (Index part = 0; part < k * k; ++part) {
      std::array<float, 4> u{0.5f, 0.5f};
      if (k > 1) u = place_rng_.uniform4(step, static_cast<std::uint64_t>((first + i) * k * k + part));
      const auto within = [&](Index p, float v) {
        return (static_cast<float>(p) + v) / static_cast<float>(k) - 0.5f;
      };
      xy[at(2 * part)] = column + within(part % k, u[0]);
      xy[at(2 * part + 1)] = row + within(part / k, u[1]);
      if (k > 1) c.jitter[at(i * k * k + part)] = u[2];
    }
    c.rays.set(field_.space, i * k * k, cameras_[at(c.images[at(i)])], std::span(xy).first(at(2 * k * k)));
  }
}

void Trainer::choose_rays(Index first, Index rays, Shard& c) const {
  const auto step = static_cast<std::uint64_t>(steps());
  const Index along = rays_along_pixel(), count = rays / (along * along);
  first /= along * along;
  c.rays.resize(rays);
  for (auto [buffer, numbers] :
       {std::pair{&c.jitter, rays}, {&c.truth, 4 * count}, {&c.background, 3 * count}})
    buffer->resize(at(numbers));
  c.places.resize(at(count));
  c.images.resize(at(count));
  std::vector<Index>& place = c.places;
  const Index width = data_.views[0].camera.width, size = width * data_.views[0].camera.height;
  // Pixels lie at random places in memory, so all of them are prefetched before the first is used, and so are
  // the entries of the pixel list.
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
    c.images[at(i)] = place[at(i)] / size;
    const View& view = data_.views[at(c.images[at(i)])];
    std::copy_n(view.rgba.data.data() + 4 * (place[at(i)] % size), 4, &c.truth[at(4 * i)]);
    const auto b = background_rng_.uniform4(step, static_cast<std::uint64_t>(first + i));
    // An opaque pixel in front of a plain background may still show that background, wholly or in part at an
    // edge.
    const bool plain = data_.scene == SceneType::plain && c.truth[at(4 * i + 3)] > 0;
    std::copy_n(plain ? data_.plain_colour.data() : b.data(), 3, &c.background[at(3 * i)]);
  }
  aim(first, c);
}

}  // namespace fieldmark::nerf
