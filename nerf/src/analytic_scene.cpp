#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/analytic_scene.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "checks.h"
#include "solids.h"
#include "transforms.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {
constexpr double kTop = -0.35;                                   // the slab's upper side
constexpr double kRadius = 4.0311, kAngle = 0.6911112070083618;  // of the Blender scenes' cameras
constexpr int kSide = 4;                                         // samples along a pixel's side
const std::array<std::string, 3> kSplits{"train", "val", "test"};

// A sphere inside a solid that casts its shadow.
struct Shade {
  Vec3 centre;
  double radius;
};
struct Object {
  Solid solid;
  SolidTexture texture;
  std::vector<Shade> shades;
};

// Spheres stacked along z, or around the ring of a torus, that fill the solid.
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

std::vector<Object> make_objects(const SceneOptions& options) {
  const CounterRng rng(options.seed, 0);
  const auto colours = shuffled_palette(rng);
  std::vector<Object> objects;
  const auto add = [&](const Solid& solid, TextureKind kind, double scale) {
    const std::size_t i = 2 * objects.size();
    objects.push_back({solid,
                       {.kind = kind,
                        .a = colours[i % colours.size()],
                        .b = colours[(i + 1) % colours.size()],
                        .scale = scale,
                        .seed = static_cast<std::uint32_t>(i)},
                       shades_of(solid)});
  };
  if (options.kind == SceneKind::sphere) {
    add({.kind = SolidKind::sphere, .size = {0.8, 0, 0}}, TextureKind::flat, 1);
    return objects;
  }
  const double turn = 2 * std::numbers::pi * rng.uniform_double(2);
  const auto place = [&](int slot, double height) {
    const double angle =
        turn +
        (slot + 0.1 * (rng.uniform_double(3, static_cast<std::uint64_t>(slot)) - 0.5)) * std::numbers::pi / 3;
    return Vec3{0.68 * std::cos(angle), 0.68 * std::sin(angle), kTop + height};
  };
  add({.kind = SolidKind::sphere, .centre = place(0, 0.28), .size = {0.28, 0, 0}}, TextureKind::marble, 0.28);
  add({.kind = SolidKind::box,
       .centre = place(1, 0.34),
       .turn = {std::cos(turn + 0.5), std::sin(turn + 0.5)},
       .size = {0.19, 0.22, 0.34}},
      TextureKind::checker, 0.22);
  add({.kind = SolidKind::torus, .centre = place(2, 0.1), .size = {0.22, 0.1, 0}}, TextureKind::stripes, 0.2);
  add({.kind = SolidKind::cylinder,
       .centre = place(3, 0.4),
       .turn = {std::cos(turn), std::sin(turn)},
       .size = {0.15, 0.4, 0}},
      TextureKind::stripes, 0.12);
  add({.kind = SolidKind::cone, .centre = place(4, 0.36), .size = {0.25, 0.36, 0}}, TextureKind::rings, 0.13);
  add({.kind = SolidKind::sphere, .centre = place(5, 0.19), .size = {0.19, 0, 0}}, TextureKind::flat, 1);
  add({.kind = SolidKind::cylinder, .centre = {0, 0, kTop + 0.25}, .size = {0.13, 0.25, 0}},
      TextureKind::noise, 0.1);
  add({.kind = SolidKind::box,
       .centre = {0, 0, kTop + 0.68},
       .turn = {std::cos(turn), std::sin(turn)},
       .size = {0.18, 0.18, 0.18}},
      TextureKind::noise, 0.2);
  objects.push_back(
      {{.kind = SolidKind::cylinder, .centre = {0, 0, kTop - 0.06}, .size = {1.1, 0.06, 0}},
       {.kind = TextureKind::checker, .a = {0.83, 0.80, 0.74}, .b = {0.52, 0.55, 0.55}, .scale = 0.36},
       {}});  // the slab lies under everything and shades nothing
  return objects;
}

// Shares of sun and sky that other objects do not occlude at a point.
std::array<double, 2> light_left(const std::vector<Object>& objects, const Object& self, const Vec3& p,
                                 const Vec3& n, const Vec3& sun) {
  constexpr double kSoft = 0.35;  // width of the sun's penumbra, per distance
  const bool lit = dot(n, sun) > 0;
  double direct = 1, sky = 1;
  for (const Object& other : objects) {
    if (&other == &self) continue;
    for (const Shade& s : other.shades) {
      const Vec3 to = s.centre - p;
      const double square = dot(to, to), along = dot(to, sun), facing = dot(to, n);
      // Most spheres do not occlude the sun: this finds them without a root.
      const double aside2 = square - along * along, clear = s.radius + 0.5 * kSoft * along;
      if (along > 0 && lit && aside2 < clear * clear) {
        const double aside = std::sqrt(std::max(0.0, aside2));
        const double u = std::clamp((aside - s.radius) / (kSoft * along) + 0.5, 0.0, 1.0);
        direct = std::min(direct, u * u * (3 - 2 * u));
      }
      if (facing > 0)
        sky *= 1 - 0.7 * std::min(1.0, s.radius * s.radius / square) * facing / std::sqrt(square);
    }
  }
  return {direct, sky};
}

// Colour at the first intersection; false if there is none.
bool trace(const std::vector<Object>& objects, const std::vector<const Object*>& candidates, const Ray& ray,
           Vec3* colour) {
  const Object* object = nullptr;
  SolidHit nearest;
  for (const Object* o : candidates)
    if (const auto hit = intersect(o->solid, ray); hit && (!object || hit->t < nearest.t)) {
      object = o;
      nearest = *hit;
    }
  if (!object) return false;
  static const Vec3 sun = normalised({0.45, -0.4, 0.8});
  const Vec3& n = nearest.normal;
  const auto [direct, sky] = light_left(objects, *object, ray.origin + nearest.t * ray.direction, n, sun);
  const double light = (0.42 + 0.16 * n[2]) * sky + 0.55 * direct * std::max(0.0, dot(n, sun));
  *colour = light * texture_colour(object->texture, nearest.local);
  return true;
}

// Objects whose bounding spheres a sample of the pixel may meet: samples are within an angle of 0.75 / focal
// of the pixel's middle.
void find_candidates(const std::vector<Object>& objects, const Camera& camera, const Ray& middle,
                     std::vector<const Object*>* candidates) {
  candidates->clear();
  const double spread = 0.75 / std::min(camera.fx, camera.fy);
  for (const Object& o : objects) {
    const Vec3 to = o.solid.centre - middle.origin;
    const double square = dot(to, to), along = dot(to, middle.direction);
    const double reach = bounding_radius(o.solid) + spread * std::sqrt(square);
    if (square - along * along <= reach * reach) candidates->push_back(&o);
  }
}

void render_pixel(const std::vector<Object>& objects, const Camera& camera, double x, double y,
                  std::vector<const Object*>* candidates, float* rgba) {
  Vec3 sum{};
  int covered = 0;
  find_candidates(objects, camera, pixel_ray(camera, x, y), candidates);
  for (int s = 0; s < kSide * kSide && !candidates->empty(); ++s) {
    const int column = s % kSide, row = s / kSide;
    const double dx = (column + 0.5) / kSide - 0.5, dy = (row + 0.5) / kSide - 0.5;
    Vec3 colour;
    if (!trace(objects, *candidates, pixel_ray(camera, x + dx, y + dy), &colour)) continue;
    sum = sum + colour;
    ++covered;
  }
  const auto byte = [](double v) {
    return static_cast<float>(std::floor(255 * std::clamp(v, 0.0, 1.0) + 0.5) / 255);
  };
  for (std::size_t k = 0; k < 3; ++k) rgba[k] = covered ? byte(sum[k] / covered) : 0.0f;
  rgba[3] = byte(static_cast<double>(covered) / (kSide * kSide));
}

Tensor<float> render(const std::vector<Object>& objects, const Camera& camera) {
  Tensor<float> image(Shape{camera.height, camera.width, 4});
  parallel_for(camera.height, 8, [&](Index begin, Index end) {
    std::vector<const Object*> candidates;
    for (Index y = begin; y < end; ++y)
      for (Index x = 0; x < camera.width; ++x)
        render_pixel(objects, camera, static_cast<double>(x), static_cast<double>(y), &candidates,
                     image.data.data() + 4 * (y * camera.width + x));
  });
  return image;
}

void check_options(const SceneOptions& o) {
  check_range("scene", "size", o.size, 1, 8192);
  check_range("scene", "views", o.views, 1, 100000);
}

// Directions follow the R2 sequence (Roberts 2018), so that any number of views covers the half sphere
// evenly.
std::vector<Camera> split_cameras(const SceneOptions& options, const std::string& split) {
  const auto which = std::find(kSplits.begin(), kSplits.end(), split);
  if (which == kSplits.end())
    throw ValueError("[scene] split must be \"train\", \"val\" or \"test\", got \"" + split + "\"");
  const auto index = static_cast<std::size_t>(which - kSplits.begin());
  const Index count = std::max<Index>(1, options.views / std::array<Index, 3>{1, 10, 4}[index]);
  const CounterRng rng(options.seed, 1 + index);
  const double first[2] = {rng.uniform_double(0), rng.uniform_double(1)};
  std::vector<Camera> cameras;
  for (Index i = 0; i < count; ++i) {
    const auto part = [&](int k, double step) {
      return std::fmod(first[k] + static_cast<double>(i) * step, 1.0);
    };
    const double azimuth = 2 * std::numbers::pi * part(0, 0.7548776662466927);
    const double up = 0.06 + 0.91 * part(1, 0.5698402909980532), across = std::sqrt(1 - up * up);
    const Vec3 eye = kRadius * Vec3{across * std::cos(azimuth), across * std::sin(azimuth), up};
    cameras.push_back(make_camera(look_at(eye, {0, 0, 0}, {0, 0, 1}), kAngle, options.size, options.size));
  }
  return cameras;
}
}  // namespace

Tensor<float> render_scene(const SceneOptions& options, const Camera& camera) {
  check_options(options);
  return render(make_objects(options), camera);
}

Dataset make_scene(const SceneOptions& options, const std::string& split, Background background) {
  check_options(options);
  const auto objects = make_objects(options);
  Dataset set{.name = options.kind == SceneKind::sphere ? "sphere" : "objects",
              .split = split,
              .background = background,
              .views = {}};
  for (const Camera& camera : split_cameras(options, split))
    set.views.push_back({camera, render(objects, camera), "r_" + std::to_string(set.views.size())});
  return set;
}

void write_scene(const SceneOptions& options, const std::filesystem::path& folder,
                 const SceneProgress& progress) {
  check_options(options);
  const auto objects = make_objects(options);
  Index total = 0, done = 0;
  for (const std::string& split : kSplits) total += static_cast<Index>(split_cameras(options, split).size());
  for (const std::string& split : kSplits) {
    std::error_code error;
    std::filesystem::create_directories(folder / split, error);
    if (error) throw IoError((folder / split).string() + ": cannot make the folder: " + error.message());
    const auto cameras = split_cameras(options, split);
    Transforms transforms{.camera_angle_x = kAngle, .frames = {}};
    for (std::size_t i = 0; i < cameras.size(); ++i)
      transforms.frames.push_back({"./" + split + "/r_" + std::to_string(i), cameras[i].pose});
    // Whole views in parallel, PNG compression included, in batches for the progress.
    constexpr Index kBatch = 8;
    const Index count = static_cast<Index>(cameras.size());
    for (Index first = 0; first < count; first += kBatch) {
      const Index batch = std::min(kBatch, count - first);
      parallel_for(batch, 1, [&](Index begin, Index) {
        const auto i = static_cast<std::size_t>(first + begin);
        write_png(folder / (transforms.frames[i].file_path + ".png"), render(objects, cameras[i]));
      });
      done += batch;
      if (progress) progress(done, total);
    }
    write_file_atomically(folder / ("transforms_" + split + ".json"), format_transforms(transforms));
  }
}

}  // namespace fieldmark::nerf
