#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/analytic_scene.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
Camera from(const Vec3& eye, Index size) {
  return make_camera(look_at(eye, {0, 0, 0}, {0, 0, 1}), 0.6911, size, size);
}
}  // namespace

TEST_CASE("analytic_scene: the sphere is a disc of the projected radius, brightest towards the sun") {
  const SceneOptions options{.kind = SceneKind::sphere, .size = 81};
  const Tensor<float> image = render_scene(options, from({4, 0, 0}, 81));
  const double focal = 40.5 / std::tan(0.6911 / 2), radius = focal * 0.8 / std::sqrt(16 - 0.64);
  double area = 0;
  for (Index y = 0; y < 81; ++y)
    for (Index x = 0; x < 81; ++x) {
      const float a = image[4 * (81 * y + x) + 3];
      const double r = std::hypot(static_cast<double>(x) - 40, static_cast<double>(y) - 40);
      if (r < radius - 1) CHECK(a == 1);
      if (r > radius + 1) CHECK(a == 0);
      area += a;
    }
  CHECK(std::abs(area / (std::acos(-1) * radius * radius) - 1) < 0.01);
  const auto red = [&](Index y, Index x) { return image[4 * (81 * y + x)]; };
  CHECK(red(25, 40) > red(40, 40));
  CHECK(red(40, 40) > red(55, 40));
}

TEST_CASE("analytic_scene: objects have texture, flat areas, shadow and a clear outline") {
  const Tensor<float> image = render_scene({.size = 64}, from({3, -1.5, 2}, 64));
  Index opaque = 0, clear = 0, flat = 0, busy = 0;
  for (Index y = 0; y < 64; ++y)
    for (Index x = 0; x + 1 < 64; ++x) {
      const float* p = image.data.data() + 4 * (64 * y + x);
      opaque += p[3] == 1;
      clear += p[3] == 0;
      if (p[3] < 1 || p[7] < 1) continue;
      const float step = std::abs(p[1] - p[5]);
      flat += step < 0.01f;
      busy += step > 0.1f;
    }
  CHECK(opaque > 64 * 64 / 5);
  CHECK(clear > 64 * 64 / 5);
  CHECK(flat > opaque / 8);
  CHECK(busy > opaque / 20);
  for (const float v : image.data) CHECK((v >= 0 && v <= 1));
}

TEST_CASE("analytic_scene: splits have their sizes and their own cameras on the upper half sphere") {
  const SceneOptions options{.size = 4, .views = 20};
  const Dataset train = make_scene(options), val = make_scene(options, "val"),
                test = make_scene(options, "test");
  CHECK(train.views.size() == 20);
  CHECK(val.views.size() == 2);
  CHECK(test.views.size() == 5);
  CHECK(make_scene({.size = 1, .views = 1}, "val").views.size() == 1);
  for (const Dataset* set : {&train, &val, &test})
    for (const View& v : set->views) {
      const Vec3 p = v.camera.position();
      CHECK(std::abs(std::hypot(p[0], p[1], p[2]) - 4.0311) < 1e-12);
      CHECK(p[2] > 0.2);
    }
  CHECK(train.views[0].camera.pose != test.views[0].camera.pose);
  CHECK(train.views[3].name == "r_3");
  CHECK(train.views[0].rgba.shape == Shape{4, 4, 4});
}

TEST_CASE("analytic_scene: what is written is what is made in memory") {
  const TemporaryFolder folder;
  const fs::path scene = folder / "scene";
  const SceneOptions options{.size = 16, .views = 9, .seed = 3};
  std::vector<Index> steps;
  write_scene(options, scene, [&](Index done, Index total) {
    CHECK(total == 12);
    steps.push_back(done);
  });
  CHECK(steps == std::vector<Index>{8, 9, 10, 12});
  for (const char* split : {"train", "val", "test"}) {
    const Dataset made = make_scene(options, split), read = load_dataset(scene, {.split = split});
    REQUIRE(read.views.size() == made.views.size());
    for (std::size_t i = 0; i < made.views.size(); ++i) {
      CHECK(read.views[i].rgba.data == made.views[i].rgba.data);
      CHECK(read.views[i].camera.pose == made.views[i].camera.pose);
      CHECK(read.views[i].camera.fx == made.views[i].camera.fx);
      CHECK(read.views[i].name == made.views[i].name);
    }
  }
}

TEST_CASE("analytic_scene: equal for one and two threads, different for another seed") {
  const auto pixels = [](int n, std::uint64_t seed) {
    const ScopedThreads scope(n);
    return make_scene({.size = 24, .views = 1, .seed = seed}).views[0].rgba.data;
  };
  const auto one = pixels(1, 0), two = pixels(2, 0);
  CHECK(one == two);
  CHECK(pixels(2, 1) != one);
}

TEST_CASE(
    "analytic_scene: a lens without distortion gives the pinhole's image, another shows what it maps to") {
  const SceneOptions options{.size = 24, .views = 1};
  const View view = make_scene(options).views[0];
  const auto through = [&](double scale) {
    return render_scene(options, view.camera,
                        [&](double x, double y) -> std::array<double, 2> {
                          return {scale * (x - view.camera.cx) / view.camera.fx,
                                  scale * (y - view.camera.cy) / view.camera.fy};
                        })
        .data;
  };
  CHECK(through(1) == view.rgba.data);
  Camera wide = view.camera;
  wide.fx /= 1.5, wide.fy /= 1.5;
  CHECK(through(1.5) == render_scene(options, wide).data);
}

TEST_CASE("analytic_scene: errors") {
  CHECK_THROWS_WITH(make_scene({.size = 0}), "[scene] size must be 1 to 8192, got 0");
  CHECK_THROWS_WITH(make_scene({.views = 0}), "[scene] views must be 1 to 100000, got 0");
  CHECK_THROWS_WITH(make_scene({.size = 1}, "dev"),
                    Contains("split must be \"train\", \"val\" or \"test\", got \"dev\""));
  const TemporaryFolder folder;
  const fs::path scene = folder / "scene";
  write_file_atomically(scene, "a file");
  CHECK_THROWS_WITH(write_scene({.size = 1, .views = 1}, scene), Contains("cannot make the folder"));
  fs::remove(scene);
  const auto stop = [](Index, Index) { throw ValueError("stopped"); };
  CHECK_THROWS_WITH(write_scene({.size = 1, .views = 1}, scene, stop), "stopped");
  CHECK_FALSE(fs::exists(scene / "transforms_train.json"));
}
