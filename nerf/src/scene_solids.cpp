#include "scene_solids.h"

#include <fieldmark/engine/random.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "vec3.h"

namespace fieldmark::nerf {
namespace {
constexpr double kTop = -0.35;  // the slab's upper side

// Returns spheres that fill the solid, stacked along z or around the ring of a torus.
std::vector<Shade> shades_of(const Solid& s) {
  std::vector<Shade> shades;
  if (s.kind == SolidKind::sphere) return {{s.centre, s.size[0]}};
  if (s.kind == SolidKind::torus) {
    for (int k = 0; k < 8; ++k) {
      const double a = k * std::numbers::pi / 4;
      shades.push_back({s.centre + s.size[0] * Vec3{std::cos(a), std::sin(a), 0}, s.size[1]});
    }
    return shades;
  }
  const double height = s.kind == SolidKind::box ? s.size[2] : s.size[1];
  const double wide = s.kind == SolidKind::box ? 1.1 * std::min(s.size[0], s.size[1]) : s.size[0];
  const int count = 1 + static_cast<int>(std::ceil(height / wide));
  for (int k = 0; k < count; ++k) {
    const double up = (k + 0.5) / count;  // cone: thinner towards the apex
    const double radius = s.kind == SolidKind::cone ? wide * (1 - up) : wide;
    shades.push_back({s.centre + Vec3{0, 0, (2 * up - 1) * height}, radius});
  }
  return shades;
}

std::vector<Vec3> shuffled_palette(const CounterRng& rng) {
  const std::vector<Vec3> palette{{0.80, 0.27, 0.22}, {0.95, 0.77, 0.32}, {0.24, 0.46, 0.68},
                                  {0.86, 0.88, 0.86}, {0.33, 0.60, 0.36}, {0.93, 0.89, 0.72},
                                  {0.50, 0.32, 0.58}, {0.88, 0.62, 0.66}, {0.22, 0.27, 0.33},
                                  {0.74, 0.79, 0.55}, {0.85, 0.49, 0.25}, {0.45, 0.71, 0.75}};
  std::vector<Vec3> colours;
  for (const Index i : permutation(static_cast<Index>(palette.size()), rng, 1))
    colours.push_back(palette[static_cast<std::size_t>(i)]);
  return colours;
}

// Collects solids whose colours run through a palette chosen by the seed.
class Builder {
 public:
  explicit Builder(std::uint64_t seed) : rng(seed, 0), colours_(shuffled_palette(rng)) {}

  void add(const Solid& solid, TextureKind kind, double scale = 1, double gloss = 0) {
    const std::size_t i = 2 * solids.size();
    solids.push_back({.solid = solid,
                      .texture = {.kind = kind,
                                  .a = colours_[i % colours_.size()],
                                  .b = colours_[(i + 1) % colours_.size()],
                                  .scale = scale,
                                  .seed = static_cast<std::uint32_t>(i)},
                      .shades = shades_of(solid),
                      .gloss = gloss});
  }
  // The slab lies under everything and casts no shadow.
  void add_slab(const SolidTexture& texture, double gloss = 0) {
    solids.push_back({{.kind = SolidKind::cylinder, .centre = {0, 0, kTop - 0.06}, .size = {1.1, 0.06, 0}},
                      texture,
                      {},
                      gloss});
  }

  CounterRng rng;
  std::vector<SceneSolid> solids;

 private:
  std::vector<Vec3> colours_;
};

constexpr Vec3 kPale{0.83, 0.80, 0.74}, kGrey{0.52, 0.55, 0.55};

double drawn_turn(const CounterRng& rng) { return 2 * std::numbers::pi * rng.uniform_double(2); }

std::array<double, 2> turned(double angle) { return {std::cos(angle), std::sin(angle)}; }

void add_objects(Builder& scene) {
  const double turn = drawn_turn(scene.rng);
  const auto place = [&](int slot, double height) {
    const double angle =
        turn + (slot + 0.1 * (scene.rng.uniform_double(3, static_cast<std::uint64_t>(slot)) - 0.5)) *
                   std::numbers::pi / 3;
    return Vec3{0.68 * std::cos(angle), 0.68 * std::sin(angle), kTop + height};
  };
  scene.add({.kind = SolidKind::sphere, .centre = place(0, 0.28), .size = {0.28, 0, 0}}, TextureKind::marble,
            0.28);
  scene.add({.kind = SolidKind::box,
             .centre = place(1, 0.34),
             .turn = {std::cos(turn + 0.5), std::sin(turn + 0.5)},
             .size = {0.19, 0.22, 0.34}},
            TextureKind::checker, 0.22);
  scene.add({.kind = SolidKind::torus, .centre = place(2, 0.1), .size = {0.22, 0.1, 0}}, TextureKind::stripes,
            0.2);
  scene.add({.kind = SolidKind::cylinder,
             .centre = place(3, 0.4),
             .turn = {std::cos(turn), std::sin(turn)},
             .size = {0.15, 0.4, 0}},
            TextureKind::stripes, 0.12);
  scene.add({.kind = SolidKind::cone, .centre = place(4, 0.36), .size = {0.25, 0.36, 0}}, TextureKind::rings,
            0.13);
  scene.add({.kind = SolidKind::sphere, .centre = place(5, 0.19), .size = {0.19, 0, 0}}, TextureKind::flat,
            1);
  scene.add({.kind = SolidKind::cylinder, .centre = {0, 0, kTop + 0.25}, .size = {0.13, 0.25, 0}},
            TextureKind::noise, 0.1);
  scene.add({.kind = SolidKind::box,
             .centre = {0, 0, kTop + 0.68},
             .turn = {std::cos(turn), std::sin(turn)},
             .size = {0.18, 0.18, 0.18}},
            TextureKind::noise, 0.2);
  scene.add_slab({.kind = TextureKind::checker, .a = kPale, .b = kGrey, .scale = 0.36});
}

// Adds a cable: beads along a parabola that sags by `sag` below the line between its ends.
void add_cable(Builder& scene, const Vec3& from, const Vec3& to, double sag, double radius) {
  constexpr int kBeads = 48;
  for (int k = 1; k < kBeads; ++k) {
    const double t = static_cast<double>(k) / kBeads;
    const Vec3 on_line = (1 - t) * from + t * to;
    scene.add({.kind = SolidKind::sphere,
               .centre = on_line + Vec3{0, 0, -4 * sag * t * (1 - t)},
               .size = {radius, 0, 0}},
              TextureKind::flat);
  }
}

void add_wires(Builder& scene) {
  constexpr double kRod = 0.016, kPost = 0.024, kLeg = 0.62;
  constexpr int kLegs = 5;
  const double turn = drawn_turn(scene.rng);
  const auto rod = [&](const Vec3& middle, double half) {
    scene.add({.kind = SolidKind::cylinder, .centre = middle, .size = {kRod, half, 0}}, TextureKind::stripes,
              0.1);
  };
  const auto ring = [&](double height, double radius) {
    scene.add({.kind = SolidKind::torus, .centre = {0, 0, kTop + height}, .size = {radius, kRod, 0}},
              TextureKind::flat);
  };
  scene.add({.kind = SolidKind::cylinder, .centre = {0, 0, kTop + 0.6}, .size = {kPost, 0.6, 0}},
            TextureKind::rings, 0.1);
  std::vector<Vec3> tops;
  for (int k = 0; k < kLegs; ++k) {
    const double angle = turn + 2 * std::numbers::pi * k / kLegs;
    const double half = 0.2 + 0.12 * scene.rng.uniform_double(3, static_cast<std::uint64_t>(k));
    const Vec3 foot{kLeg * std::cos(angle), kLeg * std::sin(angle), kTop};
    rod(foot + Vec3{0, 0, half}, half);
    tops.push_back(foot + Vec3{0, 0, 2 * half});
  }
  for (const double height : {0.5, 0.8})  // arms across the post
    scene.add({.kind = SolidKind::box,
               .centre = {0, 0, kTop + height},
               .turn = turned(turn + 2 * height),
               .size = {0.42, kRod, kRod}},
              TextureKind::checker, 0.16);
  ring(0.3, 0.34);
  ring(0.95, 0.2);
  const Vec3 top{0, 0, kTop + 1.18};
  for (const Vec3& end : tops) add_cable(scene, top, end, 0.18, 0.014);
  ring(kRod, kLeg);
}

void add_plain(Builder& scene) {
  const double turn = drawn_turn(scene.rng);
  const auto at = [&](double angle, double distance, double height) {
    return Vec3{distance * std::cos(turn + angle), distance * std::sin(turn + angle), kTop + height};
  };
  const auto box = [&](const Vec3& middle, double angle, const Vec3& half) {
    scene.add({.kind = SolidKind::box, .centre = middle, .turn = turned(turn + angle), .size = half},
              TextureKind::flat);
  };
  box(at(0, 0.55, 0.5), 0, {0.1, 0.62, 0.5});
  box(at(2.2, 0.5, 0.2), 0.7, {0.32, 0.26, 0.2});
  scene.add({.kind = SolidKind::cylinder, .centre = at(4.2, 0.55, 0.3), .size = {0.28, 0.3, 0}},
            TextureKind::flat);
  scene.add({.kind = SolidKind::sphere, .centre = at(3.2, 0.1, 0.24), .size = {0.24, 0, 0}},
            TextureKind::flat);
  scene.add_slab({.kind = TextureKind::flat, .a = kPale});
}

void add_glossy(Builder& scene) {
  const double turn = drawn_turn(scene.rng);
  const auto at = [&](double angle, double distance, double height) {
    return Vec3{distance * std::cos(turn + angle), distance * std::sin(turn + angle), kTop + height};
  };
  scene.add({.kind = SolidKind::sphere, .centre = at(0, 0.1, 0.4), .size = {0.4, 0, 0}}, TextureKind::marble,
            0.4, 0.6);
  scene.add(
      {.kind = SolidKind::box, .centre = at(1.2, 0.72, 0.22), .turn = turned(turn), .size = {0.2, 0.2, 0.22}},
      TextureKind::noise, 0.25, 0.5);
  scene.add({.kind = SolidKind::cylinder, .centre = at(2.8, 0.72, 0.32), .size = {0.18, 0.32, 0}},
            TextureKind::stripes, 0.2, 0.7);
  scene.add({.kind = SolidKind::torus, .centre = at(4.2, 0.68, 0.11), .size = {0.24, 0.11, 0}},
            TextureKind::flat, 1, 0.8);
  scene.add({.kind = SolidKind::cone, .centre = at(5.4, 0.72, 0.3), .size = {0.22, 0.3, 0}},
            TextureKind::rings, 0.2, 0.4);
  scene.add_slab({.kind = TextureKind::checker, .a = kPale, .b = kGrey, .scale = 0.5}, 0.3);
}

}  // namespace

std::vector<SceneSolid> scene_solids(SceneKind kind, std::uint64_t seed) {
  Builder scene(seed);
  switch (kind) {
    case SceneKind::sphere:
      scene.add({.kind = SolidKind::sphere, .size = {0.8, 0, 0}}, TextureKind::flat);
      break;
    case SceneKind::wires:
      add_wires(scene);
      break;
    case SceneKind::plain:
      add_plain(scene);
      break;
    case SceneKind::glossy:
      add_glossy(scene);
      break;
    default:
      add_objects(scene);
  }
  return std::move(scene.solids);
}

}  // namespace fieldmark::nerf
