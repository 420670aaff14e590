#include "camera_search.h"
#include <fieldmark/core/error.h>
#include <fieldmark/distort/distortion.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/random.h>
#include "camera_motion.h"

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "watermark/cameras_apart.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr CameraSearchOptions kOptions{.views = 60, .size = 32};

nerf::Camera near_camera(const Owner& owner, Index size, std::uint64_t seed) {
  return nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, 1, size, seed).front();
}

bool one_is_close(const std::vector<nerf::Camera>& found, const nerf::Camera& camera) {
  return std::any_of(found.begin(), found.end(),
                     [&](const nerf::Camera& c) { return cameras_apart(camera, c) < 8; });
}

// Returns what an extractor would see that is right in two places of three.
SeenPlaces places_of(const Owner& owner, const nerf::Camera& camera) {
  nerf::Renderer renderer(owner.field);
  const CachedView view = cache_view(renderer, owner.field, camera);
  SeenPlaces places{{0, 0, static_cast<double>(camera.width), static_cast<double>(camera.height)},
                    view.height,
                    view.width,
                    {},
                    {}};
  const CounterRng rng(3);
  for (Index p = 0; p < view.height * view.width; ++p) {
    const auto at = static_cast<std::size_t>(p);
    const bool some = view.sample_begin[at] < view.sample_begin[at + 1];
    std::int32_t cell =
        some ? owner.cells.at(&view.position[3 * static_cast<std::size_t>(view.sample_begin[at])]) : -1;
    if (cell >= 0 && p % 3 == 0)
      cell = static_cast<std::int32_t>(rng.below(owner.cells.count(), static_cast<std::uint64_t>(p)));
    places.cell.push_back(cell);
    places.share.push_back(0.5f);
  }
  return places;
}
}  // namespace

TEST_CASE("camera_search: places that the extractor recognised lead to the camera, turned and cut or not") {
  const Owner owner = tiny_owner();
  const CameraSearch search(owner, kOptions);
  for (const std::uint64_t seed : {11u, 12u, 13u}) {
    nerf::Camera camera = near_camera(owner, 48, seed);
    if (seed == 12) camera = moved(camera, {0, 0, 0}, {0, 0, 0.5, 0, 0, 0, 0.2, 0.1, 0});
    if (seed == 13) {  // a wide image, in the middle of the square one
      camera.height = 36;
      camera.cy -= 6;
    }
    const auto found = search.find(places_of(owner, camera), camera.height, 48, 3);
    REQUIRE(found.size() == 3);
    CAPTURE(seed);
    // Cells are a sixth of the cube, 6 pixels; alignment converges from a camera within half a cell.
    CHECK(cameras_apart(camera, found.front()) < 3);
    CHECK(found.front().width == 48);
  }
}

TEST_CASE("camera_search: the whole object in an image leads to the camera, turned or not") {
  const Owner owner = tiny_owner();
  const CameraSearch search(owner, kOptions);
  nerf::Renderer renderer(owner.field);
  Index upright = 0, turned = 0;
  for (const std::uint64_t seed : {11u, 12u, 13u, 14u})
    for (const bool turn : {false, true}) {
      nerf::Camera camera = near_camera(owner, 96, seed);
      if (turn) camera = moved(camera, {0, 0, 0}, {0, 0, 0.5, 0, 0, 0, -0.2, 0.05, 0});
      const auto found = search.find(renderer.render(camera).rgb, 3);
      REQUIRE(found.size() == 3);
      (turn ? turned : upright) += one_is_close(found, camera);
    }
  CHECK(upright >= 3);  // 60 renders are about 15 degrees apart
  CHECK(turned >= 3);
}

TEST_CASE("camera_search: lightness leads to the camera whatever the hue, and likeness knows the scene") {
  const Owner owner = tiny_owner();
  const CameraSearch search(owner, kOptions);
  nerf::Renderer renderer(owner.field);
  const std::vector<float> white(3, 1.f);
  const auto turn = distort::parse_distortion("hue_180"), wide = distort::parse_distortion("stretch_1.5");
  Index close = 0;
  for (const std::uint64_t seed : {11u, 13u, 14u}) {
    const nerf::Camera camera = near_camera(owner, 96, seed);
    const Tensor<float> view = renderer.render(camera).rgb;
    const Tensor<float> turned = distort::apply_distortion(turn, view, CounterRng(1), 0, white);
    close += one_is_close(search.find_by_lightness(turned, 3), camera);
    const double likeness = search.likeness(view);
    CHECK(likeness > 0.9);
    CHECK(likeness > search.likeness(distort::apply_distortion(wide, view, CounterRng(1), 0, white)));
  }
  CHECK(close >= 2);
}

TEST_CASE("camera_search: an object is found from below, where no training image was taken") {
  const Owner owner = tiny_owner();
  REQUIRE(owner.field.space.kind == nerf::SpaceKind::cube);
  nerf::Renderer renderer(owner.field);
  const auto close = [&](Index around) {
    const CameraSearch search(owner, {.views = 60, .around = around, .size = 32});
    Index n = 0;
    for (const auto& camera :
         nerf::make_cameras(owner.field.cameras, nerf::CameraSet::extrapolated, 8, 96, 21))
      n += one_is_close(search.find(renderer.render(camera).rgb, 3), camera);
    return n;
  };
  const Index without = close(0), with = close(120);
  CAPTURE(without, with);
  CHECK(with >= 6);
  CHECK(with > without + 2);
}

TEST_CASE("camera_search: two fifths of an image lead to the camera") {
  const Owner owner = tiny_owner();
  const CameraSearch search(owner, kOptions);
  nerf::Renderer renderer(owner.field);
  Index close = 0;
  for (const std::uint64_t seed : {11u, 12u, 13u, 14u}) {
    nerf::Camera camera = near_camera(owner, 96, seed);
    camera.cx -= 20;  // 60 x 64 pixels of 96 x 96
    camera.cy -= 16;
    camera.width = 60;
    camera.height = 64;
    const auto found = search.find_part(renderer.render(camera).rgb, 6);
    REQUIRE(found.size() == 6);
    CHECK(found.front().width == 60);
    CHECK(found.front().height == 64);
    close += one_is_close(found, camera);
  }
  CHECK(close >= 3);
}

TEST_CASE(
    "camera_search: cameras have the pixels of the owner's images, where small renders cannot have their "
    "shape") {
  Owner owner = tiny_owner();
  owner.field.cameras.width = 100;
  owner.field.cameras.height = 53;  // 16.96 of 32: stretched to 17, the error would be 0.2%; of 54 1.6%
  for (const Index height : {53, 54}) {
    owner.field.cameras.height = height;
    const CameraSearch search(owner, kOptions);
    const nerf::Camera camera = near_camera(owner, 100, 11);
    REQUIRE(camera.height == height);
    const double pixel = camera.fy / camera.fx;
    const Tensor<float> image = nerf::Renderer(owner.field).render(camera).rgb;
    std::vector<nerf::Camera> found = search.find(image, 3);
    for (const auto& c : search.find_part(image, 3)) found.push_back(c);
    for (const auto& c : search.find(places_of(owner, camera), height, 100, 3)) found.push_back(c);
    REQUIRE(found.size() == 9);
    CAPTURE(height);
    for (const auto& c : found) CHECK(std::abs(c.fy / c.fx / pixel - 1) < 1e-9);
  }
}

TEST_CASE("camera_search: nothing recognised, nothing found") {
  const Owner owner = tiny_owner();
  const CameraSearch search(owner, {.views = 5, .size = 32});
  SeenPlaces none{{0, 0, 48, 48}, 12, 12, std::vector<std::int32_t>(144, -1), std::vector<float>(144, 0.9f)};
  CHECK(search.find(none, 48, 48, 3).empty());
}

TEST_CASE("camera_search: one and two threads find the same") {
  const Owner owner = tiny_owner();
  const nerf::Camera camera = near_camera(owner, 48, 14);
  const SeenPlaces places = places_of(owner, camera);
  std::vector<std::array<double, 16>> found[2];
  for (int n : {1, 2}) {
    const ScopedThreads scope(n);
    for (const nerf::Camera& c : CameraSearch(owner, {.views = 20, .size = 32}).find(places, 48, 48, 4))
      found[n - 1].push_back(c.parameters());
  }
  CHECK(!found[0].empty());
  CHECK(found[0] == found[1]);
}

TEST_CASE("camera_search: errors name what is wrong") {
  const Owner paper = tiny_paper_owner(), owner = tiny_owner();
  CHECK_THROWS_WITH(CameraSearch(paper),
                    "[camera_search] owner must have cells in space, got one of preset paper");
  CHECK_THROWS_WITH(CameraSearch(owner, {.views = 0}),
                    "[camera_search] views, around and size must be at least 1, 0 and 16, got 0, 192 and 40");
  CHECK_THROWS_AS(CameraSearch(owner, {.size = 15}), ValueError);
  CHECK_THROWS_AS(CameraSearch(owner, {.views = 1, .size = 16}).find_part(Tensor<float>({8, 8}), 1),
                  ShapeError);
}
