#include "pose_alignment.h"
#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include "camera_motion.h"

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "watermark/cameras_apart.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr AlignmentStage kStages[] = {{.size = 32, .blur = 1.5, .steps = 10},
                                      {.size = 64, .blur = 1, .steps = 8}};

nerf::Camera aligned_camera(std::uint64_t seed) {
  return nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, 64, seed).front();
}

Tensor<float> image_of(const nerf::Camera& camera) {
  nerf::Renderer renderer(tiny_field());
  return quantize8(renderer.render(camera).rgb);
}

Alignment align(const Tensor<float>& view_image, const nerf::Camera& start) {
  PoseAligner aligner(tiny_field());
  return aligner.align(view_image, start, kStages);
}
}  // namespace

TEST_CASE("pose_alignment: a disturbed camera comes back to a tenth of a pixel") {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const nerf::Camera camera = aligned_camera(seed);
    const nerf::Camera start =
        moved(camera, {0, 0, 0}, {0.04, -0.05, 0.06, 0.03, -0.02, 0.04, 0.03, -0.02, 0.01});
    CAPTURE(seed);
    CHECK(cameras_apart(camera, start) > 2);
    const Alignment a = align(image_of(camera), start);
    CHECK(cameras_apart(camera, a.camera) < 0.1);
    CHECK(a.agreement > 0.98);
  }
}

TEST_CASE("pose_alignment: a small motion that ends the stage is made") {
  constexpr AlignmentStage kStage[] = {{.size = 64, .blur = 1, .steps = 8}};
  PoseAligner aligner(tiny_field());
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const nerf::Camera camera = aligned_camera(seed);
    const nerf::Camera start = moved(camera, {0, 0, 0}, {0.002, -0.002, 0.003, 0, 0, 0, 0.001, -0.001, 0});
    const double before = cameras_apart(camera, start);
    CAPTURE(seed, before);
    CHECK((before > 0.06 && before < 0.09));
    CHECK(cameras_apart(camera, aligner.align(image_of(camera), start, kStage).camera) < 0.3 * before);
  }
}

TEST_CASE("pose_alignment: a stage that ends at smaller motions comes nearer") {
  PoseAligner aligner(tiny_field());
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const nerf::Camera camera = aligned_camera(seed);
    const nerf::Camera start =
        moved(camera, {0, 0, 0}, {0.01, -0.02, 0.02, 0.02, -0.02, 0.03, 0.02, -0.02, 0.01});
    const auto apart = [&](double still) {
      const AlignmentStage stage[] = {{.size = 64, .blur = 1, .steps = 40, .still = still}};
      return cameras_apart(camera, aligner.align(image_of(camera), start, stage).camera);
    };
    const double coarse = apart(0.5), fine = apart(0.005);
    CAPTURE(seed, coarse, fine);
    CHECK(fine < 0.5 * coarse);
    CHECK(fine < 0.03);
  }
}

TEST_CASE("pose_alignment: plain corners do not count where the scene fills its images") {
  nerf::RadianceField field = small_field();
  field.space = {.kind = nerf::SpaceKind::contracted, .bounds = {.corner = {-1, -1, -1}, .side = 2}};
  const nerf::Camera camera =
      nerf::make_camera(nerf::look_at({0.3, -0.4, 0.2}, {0, 1, 0}, {0, 0, 1}), 0.9, 96, 96);
  nerf::Renderer renderer(field);
  Tensor<float> view_image = quantize8(renderer.render(camera).rgb), spotted = view_image;
  Index corners = 0;
  for (Index p = 0; p < 96 * 96; ++p) {
    const Index y = p / 96, x = p % 96;
    if (std::min(y, 95 - y) + std::min(x, 95 - x) >= 30) continue;
    ++corners;
    for (Index a = 0; a < 3; ++a) {
      view_image[3 * p + a] = 1;
      spotted[3 * p + a] = static_cast<float>((x / 6 + y / 6) % 2);  // as large, but not plain
    }
  }
  CHECK(corners > 1000);
  constexpr AlignmentStage kStay[] = {{.size = 96, .blur = 1, .steps = 0}};
  PoseAligner aligner(field);
  const double plain = aligner.align(view_image, camera, kStay).agreement,
               rough = aligner.align(spotted, camera, kStay).agreement;
  CAPTURE(plain, rough);
  CHECK(plain > 0.98);
  CHECK(rough < 0.8);
}

TEST_CASE("pose_alignment: a turned and cut image with other tones is met by roll, focal length and cut") {
  const nerf::Camera camera = aligned_camera(4);
  nerf::Camera part = moved(camera, {0, 0, 0}, {0, 0, 0.3, 0, 0, 0, std::log(1.3)});
  part.cx -= 4;
  part.height = 56;
  Tensor<float> view_image = image_of(part);
  for (Index i = 0; i < view_image.size(); ++i)
    view_image[i] = 0.7f * view_image[i] + 0.05f * static_cast<float>(i % 3);
  const Alignment a =
      align(view_image, moved(part, {0, 0, 0}, {0.03, 0.04, -0.08, 0, 0, 0, 0.06, 0.03, -0.02}));
  CHECK(a.camera.width == 64);
  CHECK(a.camera.height == 56);
  CHECK(cameras_apart(part, a.camera) < 0.1);
  CHECK(a.agreement > 0.98);
}

TEST_CASE("pose_alignment: images of something else do not agree") {
  const nerf::Camera camera = aligned_camera(5);
  CHECK(align(uniform<float>({64, 64, 3}, 0, 1, 3), camera).agreement < 0.3);
  // The scene from another side.
  CHECK(align(image_of(aligned_camera(6)), camera).agreement < 0.75);
  CHECK(align(Tensor<float>({64, 64, 3}, 1), camera).agreement < 0.1);
  nerf::Camera away = camera;
  for (std::size_t k : {2u, 6u, 10u}) away.pose[k] *= -1;
  CHECK(align(image_of(camera), away).agreement == -1);
}

TEST_CASE("pose_alignment: an agreement below a stage's least ends the alignment there") {
  PoseAligner aligner(tiny_field());
  const nerf::Camera camera = aligned_camera(5);
  const Tensor<float> other = image_of(aligned_camera(6));
  AlignmentStage stages[] = {kStages[0], kStages[1]};
  stages[0].least = 0.99;
  const Alignment first = aligner.align(other, camera, std::span(stages).first(1)),
                  both = aligner.align(other, camera, kStages), ended = aligner.align(other, camera, stages);
  CHECK(ended.camera.pose == first.camera.pose);
  CHECK(ended.agreement == first.agreement);
  CHECK(ended.agreement != both.agreement);
  stages[0].least = 0.5;
  CHECK(aligner.align(image_of(camera), camera, stages).agreement ==
        aligner.align(image_of(camera), camera, kStages).agreement);
}

TEST_CASE("pose_alignment: one and two threads give the same bits") {
  const nerf::Camera camera = aligned_camera(7);
  const Tensor<float> view_image = image_of(camera);
  const nerf::Camera start = moved(camera, {0, 0, 0}, {0.02, -0.03, 0.02});
  const ScopedThreads serial(1);
  const Alignment one = align(view_image, start);
  const ScopedThreads parallel(2);
  const Alignment two = align(view_image, start);
  CHECK(one.camera.pose == two.camera.pose);
  CHECK(one.camera.parameters() == two.camera.parameters());
  CHECK(one.agreement == two.agreement);
}

TEST_CASE("pose_alignment: thin objects that agree but not exactly are told apart") {
  const auto inexact = [](double agreement, double shown) {
    return is_inexact({.camera = {}, .agreement = agreement, .shown = shown});
  };
  CHECK(inexact(0.85, 0.05));
  CHECK(inexact(0.9969, 0.119));
  CHECK_FALSE(inexact(0.849, 0.05));
  CHECK_FALSE(inexact(0.997, 0.05));
  CHECK_FALSE(inexact(0.95, 0.12));
  CHECK_FALSE(inexact(std::nan(""), 0.05));
}

TEST_CASE("pose_alignment: errors name what is wrong") {
  PoseAligner aligner(tiny_field());
  const nerf::Camera camera = aligned_camera(8);
  CHECK_THROWS_AS(aligner.align(Tensor<float>({20, 20}), camera, kStages), ShapeError);
  CHECK_THROWS_AS(aligner.align(Tensor<float>({20, 20, 1}), camera, kStages), ShapeError);
  CHECK_THROWS_WITH(aligner.align(Tensor<float>({20, 20, 3}), camera, {}),
                    "[pose_aligner] stages must not be empty");
  const AlignmentStage small[] = {{.size = 8}};
  CHECK_THROWS_WITH(aligner.align(Tensor<float>({20, 20, 3}), camera, small),
                    "[pose_aligner] stages must be of at least 16 pixels, got 8");
}
