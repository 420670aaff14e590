#include "odd_cameras.h"

#include "nerf/surveyed.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
using Names = std::vector<std::string>;

namespace {
// move_out() scales the camera's distance from the origin; turn_round() rotates it by 180 degrees about its x
// axis.
void move_out(SurveyedView& view, double scale) {
  for (const std::size_t k : {3, 7, 11}) view.camera.pose[k] *= scale;
}
void turn_round(SurveyedView& view) {
  for (const std::size_t k : {1, 2, 5, 6, 9, 10}) view.camera.pose[k] *= -1;
}
// Returns views of cameras at these positions, looking along -z.
std::vector<SurveyedView> views_at(const std::vector<Vec3>& places) {
  std::vector<SurveyedView> views;
  for (const Vec3& p : places)
    views.push_back(surveyed({1, 0, 0, p[0], 0, 1, 0, p[1], 0, 0, 1, p[2]}, static_cast<int>(views.size())));
  return views;
}
}  // namespace

TEST_CASE("odd_cameras: a ring, a path and a capture with some overviews are not odd") {
  CHECK(odd_cameras(ring_of_views(12), SceneType::object).empty());
  CHECK(odd_cameras({}, SceneType::object).empty());
  std::vector<Vec3> path, overviews;
  for (int i = 0; i < 30; ++i) path.push_back({0.5 * i, std::sin(i), 0});
  for (int i = 0; i < 40; ++i)
    overviews.push_back({(i % 5 == 0 ? 5 : 1) * std::cos(i), (i % 5 == 0 ? 5 : 1) * std::sin(i), 0});
  CHECK(odd_cameras(views_at(path), SceneType::place).empty());
  CHECK(odd_cameras(views_at(overviews), SceneType::place).empty());
  // Far from the origin, like georeferenced captures.
  for (Vec3& p : path) p[0] += 5e5;
  CHECK(odd_cameras(views_at(path), SceneType::place).empty());
}

TEST_CASE("odd_cameras: cameras far from the others, of which there are at least four") {
  auto views = ring_of_views(20);
  move_out(views[4], 5), move_out(views[11], -8);
  const Oddity far = only(odd_cameras(views, SceneType::place), "outlying_cameras");
  CHECK(far.images == Names{"train/4", "train/11"});
  CHECK_THAT(far.text,
             Contains("2 of 20 cameras far from the others, the first is that of train/4 at 4.36 times the "
                      "median distance from their middle"));
  CHECK(outlying(views)[4]);
  CHECK(!outlying(views)[5]);
  auto few = ring_of_views(5);
  move_out(few[2], 9);
  CHECK(only(odd_cameras(few, SceneType::place), "outlying_cameras").count == 1);
  few.pop_back();
  CHECK(odd_cameras(few, SceneType::place).empty());
}

TEST_CASE(
    "odd_cameras: cameras of an object that look past it, and all of them where the axes are OpenCV's") {
  auto views = ring_of_views(16);
  turn_round(views[3]);
  const Oddity one = only(odd_cameras(views, SceneType::plain), "cameras_look_away");
  CHECK(one.text ==
        "1 of 16 cameras look away from the point that their axes have in common, the first is that of "
        "train/3");
  CHECK_THAT(one.remedy, !Contains("OpenCV"));
  CHECK(odd_cameras(views, SceneType::place).empty());
  for (std::size_t i = 0; i < views.size(); ++i)
    if (i != 3) turn_round(views[i]);
  const Oddity all = only(odd_cameras(views, SceneType::object), "cameras_look_away");
  CHECK(all.count == 16);
  CHECK_THAT(all.remedy, Contains("check the convention") && Contains("OpenCV's axes, negate the second"));
  const Oddity place = only(odd_cameras(views, SceneType::place), "cameras_look_away");
  CHECK_THAT(place.remedy, Contains("of a room seen from its middle this is right"));
}

TEST_CASE("odd_cameras: one pose for different images, which equal images may have") {
  auto views = ring_of_views(12);
  views[5].camera.pose = views[6].camera.pose = views[2].camera.pose;
  views[6].thumbnail = views[2].thumbnail;
  const Oddity same = only(odd_cameras(views, SceneType::place), "equal_poses");
  CHECK(same.images == Names{"train/5"});
  CHECK(same.partners == Names{"train/2"});
  CHECK(same.text ==
        "1 of 12 cameras with the pose of another though their images differ, the first is that of train/5, "
        "as that of train/2");
}

TEST_CASE("odd_cameras: principal points outside the image, or shares that are taken for pixels") {
  auto views = ring_of_views(12);
  views[1].camera.cx = -3, views[2].camera.cy = 30.5, views[3].camera.cx = 0.5, views[3].camera.cy = 0.5;
  views[4].camera.cx = std::nan(""), views[5].camera.cx = 1;
  const Oddity outside = only(odd_cameras(views, SceneType::place), "principal_points");
  CHECK(outside.images == Names{"train/1", "train/2", "train/3", "train/4"});
  CHECK(outside.text ==
        "4 of 12 principal points outside the image or in its corner, the first is that of train/1 at "
        "(-3, 15) of 40 x 30 pixels");
}

TEST_CASE("odd_cameras: focal lengths of millimetres, or of a larger image") {
  auto views = ring_of_views(12);
  views[1].camera.fx = 4, views[2].camera.fx = 2000;
  const Oddity odd = only(odd_cameras(views, SceneType::place), "focal_lengths");
  CHECK(odd.text ==
        "2 of 12 horizontal fields of view outside 2 to 150 degrees, the first is that of train/1 with 157");
}

TEST_CASE("odd_cameras: one place tells no depth") {
  auto views = ring_of_views(12);
  for (SurveyedView& v : views)
    for (const std::size_t k : {3, 7, 11}) v.camera.pose[k] = 7;
  const Oddity one = only(odd_cameras(views, SceneType::object), "one_place");
  CHECK(one.text == "12 cameras at one place");
  CHECK(odd_cameras(std::vector{views[0]}, SceneType::place).empty());
}
