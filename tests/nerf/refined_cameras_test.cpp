#include <fieldmark/core/error.h>
#include <fieldmark/nerf/refined_cameras.h>
#include <fieldmark/nerf/trainer.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "nerf/objects_scene.h"
#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
Camera camera_at(const Vec3& eye, double roll = 0) {
  return make_camera(look_at(eye, {0, 0, 0}, {std::sin(roll), 0, std::cos(roll)}), 0.9, 9, 7);
}
}  // namespace

TEST_CASE("refined_cameras: the motion between cameras is the mean angle and distance") {
  const std::vector<Camera> from{camera_at({3, 0, 0}), camera_at({0, 2, 0})};
  std::vector<Camera> to = from;
  const CameraMotion none = mean_motion(from, to);
  CHECK(none.degrees == 0);
  CHECK(none.distance == 0);
  to[1] = camera_at({0, 2, 0}, 0.02);  // about its own axis
  to[0].pose[3] += 0.3, to[0].pose[7] += 0.4;
  const CameraMotion some = mean_motion(from, to);
  CHECK(some.degrees == Approx(0.01 * 180 / 3.14159265358979).epsilon(1e-6));
  CHECK(some.distance == Approx(0.25));
  CHECK_THROWS_WITH(mean_motion(from, std::span(to).first(1)),
                    "[mean_motion] cameras must be as many as there are images, 2, got 1");
}

TEST_CASE("refined_cameras: the text of a transforms.json has every number of the cameras") {
  const std::vector<View> views{{.camera = camera_at({3, 0, 0}), .rgba = {}, .name = "a"},
                                {.camera = camera_at({0, 2, 0}), .rgba = {}, .name = "b"}};
  const std::vector<Camera> cameras{camera_at({3, 0.1, 0}), camera_at({0, 2, 0.2})};
  const auto json = nlohmann::json::parse(format_transforms(views, cameras));
  REQUIRE(json["frames"].size() == 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& frame = json["frames"][i];
    CHECK(frame["file_path"] == views[i].name);
    CHECK(frame["fl_x"] == cameras[i].fx);
    CHECK(frame["cy"] == cameras[i].cy);
    CHECK(frame["w"] == 9);
    for (std::size_t k = 0; k < 12; ++k) CHECK(frame["transform_matrix"][k / 4][k % 4] == cameras[i].pose[k]);
    CHECK(frame["transform_matrix"][3] == nlohmann::json::parse("[0.0, 0.0, 0.0, 1.0]"));
  }
  CHECK_THROWS_AS(format_transforms(views, std::span(cameras).first(1)), ShapeError);
}

TEST_CASE("refined_cameras: a displaced camera comes back to where a field shows its image") {
  RadianceField field(trainable_field_options());
  {
    TrainOptions options{.schedule = {.steps = 250}, .samples_per_step = 8192, .warm_up = 16};
    Trainer trainer(field, objects_scene(), options);
    while (!trainer.done()) trainer.step(0);
  }
  Dataset data = objects_scene();
  data.views.resize(3);
  std::vector<Camera> truth, start;
  for (View& v : data.views) {
    truth.push_back(v.camera);
    v.camera.pose[3] += 0.05, v.camera.pose[7] -= 0.04;
    start.push_back(v.camera);
  }
  const auto found = fit_cameras(field, data, {.steps = 100, .samples_per_step = 4096});
  const auto seen_off = [&](const std::vector<Camera>& cameras) {  // points seen at the scene's distance
    double sum = 0;
    for (std::size_t i = 0; i < cameras.size(); ++i)
      for (std::size_t a = 0; a < 3; ++a)
        sum += std::abs(cameras[i].position()[a] + 4 * cameras[i].forward()[a] - truth[i].position()[a] -
                        4 * truth[i].forward()[a]);
    return sum;
  };
  CAPTURE(seen_off(start), seen_off(found));
  CHECK(seen_off(found) < 0.4 * seen_off(start));
  const auto stopped =
      fit_cameras(field, data, {.steps = 100, .samples_per_step = 4096}, [](Index done, Index total) {
        CHECK(done == 16);
        CHECK(total == 100);
        return false;
      });
  CHECK(mean_motion(start, stopped).distance > 0);
  CHECK_THROWS_AS(fit_cameras(RadianceField(small_mlp_options()), data), ValueError);
}
