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
#include "scene_solids.h"
#include "transforms.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {
constexpr double kRadius = 4.0311, kAngle = 0.6911112070083618;  // of the Blender scenes' cameras
constexpr int kSide = 4;                                         // samples along a pixel's side
const std::array<std::string, 3> kSplits{"train", "val", "test"};

// Returns the shares of sun and sky at a point that other objects do not occlude.
std::array<double, 2> light_left(const std::vector<SceneSolid>& objects, const SceneSolid& self,
                                 const Vec3& p, const Vec3& n, const Vec3& sun) {
  constexpr double kSoft = 0.35;  // width of the sun's penumbra, per distance
  const bool lit = dot(n, sun) > 0;
  double direct = 1, sky = 1;
  for (const SceneSolid& other : objects) {
    if (&other == &self) continue;
    for (const Shade& s : other.shades) {
      const Vec3 to = s.centre - p;
      const double square = dot(to, to), along = dot(to, sun), facing = dot(to, n);
      // Most spheres do not occlude the sun; this test finds them without a square root.
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

// Returns the colour of a surface that reflects the sun, as a lobe, and a sky that is brighter at the top.
Vec3 glossy(const Vec3& diffuse, double gloss, const Vec3& direction, const Vec3& n, const Vec3& sun,
            double direct) {
  constexpr double kSharpness = 40, kSun = 0.8, kHorizon = 0.25, kSky = 0.45;
  const Vec3 mirrored = direction + (-2 * dot(direction, n)) * n;
  const double lobe = kSun * direct * std::pow(std::max(0.0, dot(mirrored, sun)), kSharpness);
  const double reflected = lobe + kHorizon + kSky * std::max(0.0, mirrored[2]);
  return (1 - gloss) * diffuse + gloss * Vec3{reflected, reflected, reflected};
}

// Writes the colour at the first intersection; returns false if there is none.
bool trace(const std::vector<SceneSolid>& objects, const std::vector<const SceneSolid*>& candidates,
           const Ray& ray, Vec3* colour) {
  const SceneSolid* object = nullptr;
  SolidHit nearest;
  for (const SceneSolid* o : candidates)
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
  if (object->gloss > 0) *colour = glossy(*colour, object->gloss, ray.direction, n, sun, direct);
  return true;
}

// Rays by image coordinates in pixels, and a bound on the angle in radians between the rays of the pixel
// around a point and the ray through that point.
struct PixelRays {
  std::function<Ray(double x, double y)> at;
  std::function<double(double x, double y)> spread;
};

PixelRays pinhole_rays(const Camera& camera) {
  return {[&camera](double x, double y) { return pixel_ray(camera, x - 0.5, y - 0.5); },
          [&camera](double, double) { return 0.75 / std::min(camera.fx, camera.fy); }};
}

PixelRays lens_rays(const Pose& pose, const ImageToPlane& to_plane) {
  const Camera plane{.pose = pose, .fx = 1, .fy = 1, .cx = 0.5, .cy = 0.5};
  const auto spread = [&to_plane](double x, double y) {
    const auto middle = to_plane(x, y);
    double most = 0;
    for (const double dy : {-0.5, 0.5})
      for (const double dx : {-0.5, 0.5}) {
        const auto corner = to_plane(x + dx, y + dy);
        most = std::max(most, std::hypot(corner[0] - middle[0], corner[1] - middle[1]));
      }
    return 1.06 * most;  // as 0.75 is of half a diagonal
  };
  return {[plane, &to_plane](double x, double y) {
            const auto q = to_plane(x, y);
            return pixel_ray(plane, q[0], q[1]);
          },
          spread};
}

// Finds the objects whose bounding spheres a ray within `spread` radians of `middle` may hit.
void find_candidates(const std::vector<SceneSolid>& objects, const Ray& middle, double spread,
                     std::vector<const SceneSolid*>* candidates) {
  candidates->clear();
  for (const SceneSolid& o : objects) {
    const Vec3 to = o.solid.centre - middle.origin;
    const double square = dot(to, to), along = dot(to, middle.direction);
    const double reach = bounding_radius(o.solid) + spread * std::sqrt(square);
    if (square - along * along <= reach * reach) candidates->push_back(&o);
  }
}

void render_pixel(const std::vector<SceneSolid>& objects, const PixelRays& rays, double x, double y,
                  std::vector<const SceneSolid*>* candidates, float* rgba) {
  Vec3 sum{};
  int covered = 0;
  find_candidates(objects, rays.at(x + 0.5, y + 0.5), rays.spread(x + 0.5, y + 0.5), candidates);
  for (int s = 0; s < kSide * kSide && !candidates->empty(); ++s) {
    const int column = s % kSide, row = s / kSide;
    const double dx = (column + 0.5) / kSide, dy = (row + 0.5) / kSide;
    Vec3 colour;
    if (!trace(objects, *candidates, rays.at(x + dx, y + dy), &colour)) continue;
    sum = sum + colour;
    ++covered;
  }
  const auto byte = [](double v) {
    return static_cast<float>(std::floor(255 * std::clamp(v, 0.0, 1.0) + 0.5) / 255);
  };
  for (std::size_t k = 0; k < 3; ++k) rgba[k] = covered ? byte(sum[k] / covered) : 0.0f;
  rgba[3] = byte(static_cast<double>(covered) / (kSide * kSide));
}

Tensor<float> render(const std::vector<SceneSolid>& objects, const Camera& camera, const PixelRays& rays) {
  Tensor<float> image(Shape{camera.height, camera.width, 4});
  parallel_for(camera.height, 8, [&](Index begin, Index end) {
    std::vector<const SceneSolid*> candidates;
    for (Index y = begin; y < end; ++y)
      for (Index x = 0; x < camera.width; ++x)
        render_pixel(objects, rays, static_cast<double>(x), static_cast<double>(y), &candidates,
                     image.data.data() + 4 * (y * camera.width + x));
  });
  return image;
}

Tensor<float> render(const std::vector<SceneSolid>& objects, const Camera& camera) {
  return render(objects, camera, pinhole_rays(camera));
}

void check_options(const SceneOptions& o) {
  check_range("scene", "size", o.size, 1, 8192);
  check_range("scene", "views", o.views, 1, 100000);
}

// Directions follow the R2 sequence (Roberts 2018), so that any number of views covers the hemisphere evenly.
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

const char* scene_kind_name(SceneKind kind) {
  switch (kind) {
    case SceneKind::sphere:
      return "sphere";
    case SceneKind::wires:
      return "wires";
    case SceneKind::plain:
      return "plain";
    case SceneKind::glossy:
      return "glossy";
    default:
      return "objects";
  }
}

SceneKind parse_scene_kind(std::string_view name) {
  for (const SceneKind kind : kSceneKinds)
    if (name == scene_kind_name(kind)) return kind;
  throw ValueError("[scene] kind must be objects, sphere, wires, plain or glossy, got \"" +
                   std::string(name) + "\"");
}

Tensor<float> render_scene(const SceneOptions& options, const Camera& camera) {
  check_options(options);
  return render(scene_solids(options.kind, options.seed), camera);
}

Tensor<float> render_scene(const SceneOptions& options, const Camera& camera, const ImageToPlane& to_plane) {
  check_options(options);
  return render(scene_solids(options.kind, options.seed), camera, lens_rays(camera.pose, to_plane));
}

Dataset make_scene(const SceneOptions& options, const std::string& split, Background background) {
  check_options(options);
  const auto objects = scene_solids(options.kind, options.seed);
  Dataset set{.name = scene_kind_name(options.kind), .split = split, .background = background, .views = {}};
  for (const Camera& camera : split_cameras(options, split))
    set.views.push_back({camera, render(objects, camera), "r_" + std::to_string(set.views.size())});
  return set;
}

void write_scene(const SceneOptions& options, const std::filesystem::path& folder,
                 const SceneProgress& progress) {
  check_options(options);
  const auto objects = scene_solids(options.kind, options.seed);
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
    // Renders and compresses whole views in parallel, in batches, so that progress can be reported.
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
