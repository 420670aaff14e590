#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/nerf/data_survey.h>

#include <cmath>

#include "nerf/objects_scene.h"
#include "nerf/surveyed.h"
#include "nerf/training_images.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
using Names = std::vector<std::string>;
namespace fs = std::filesystem;

namespace {
Dataset one_view(Tensor<float> rgba) {
  const Index height = rgba.shape[0], width = rgba.shape[1];
  Dataset data{.name = "d", .split = "train", .views = {}};
  data.views.push_back({.camera = make_camera({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 4}, 0.7, width, height),
                        .rgba = std::move(rgba),
                        .name = "v"});
  return data;
}

// Adds noise like that of a lossy file.
void disturb(View& view, double by) {
  const auto noise = uniform<float>(view.rgba.shape, -by, by, 9);
  for (Index i = 0; i < noise.size(); ++i) view.rgba[i] = std::clamp(view.rgba[i] + noise[i], 0.f, 1.f);
}
}  // namespace

TEST_CASE("data_survey: thumbnails are an area filter's of premultiplied colour") {
  const Tensor<float> image = uniform<float>({64, 96, 4}, 0, 1, 3);
  Tensor<float> premultiplied = image;
  for (Index i = 0; i < image.size(); ++i)
    if (i % 4 != 3) premultiplied[i] *= image[i - i % 4 + 3];
  const Tensor<float> expected = resize_area(premultiplied, 32, 32);
  const SurveyedView view = survey_views(one_view(image)).front();
  REQUIRE(view.thumbnail.size() == 32 * 32 * 4);
  for (Index i = 0; i < expected.size(); ++i)
    REQUIRE(view.thumbnail[at(i)] == Approx(expected[i]).margin(1e-5));
  CHECK((view.name == "v" && view.split == "train" && view.width == 96 && view.height == 64));
  // An image smaller than the thumbnail, with any number of threads.
  const auto small = survey_views(one_view(uniform<float>({5, 40, 4}, 0, 1, 4)));
  CHECK(small[0].thumbnail.size() == 32 * 32 * 4);
  std::vector<SurveyedView> one, two;
  {
    const ScopedThreads threads(1);
    one = survey_views(objects_scene());
  }
  {
    const ScopedThreads threads(2);
    two = survey_views(objects_scene());
  }
  for (std::size_t i = 0; i < one.size(); ++i) CHECK(one[i].thumbnail == two[i].thumbnail);
}

TEST_CASE("data_survey: what fills an image up counts for nothing") {
  Dataset data = one_view(uniform<float>({20, 30, 4}, 0, 1, 5));
  const SurveyedView plain = survey_views(data).front();
  View& view = data.views.front();
  Tensor<float> filled(Shape{40, 50, 4}, 0.5f);
  paste(filled, view.rgba, 0, 0);
  view.rgba = filled, view.camera.width = 50, view.camera.height = 40;
  view.own_width = 30, view.own_height = 20, view.file_width = 60, view.file_height = 40;
  view.valid.assign(40 * 50, 0);
  for (std::size_t y = 0; y < 20; ++y)
    for (std::size_t x = 0; x < 15; ++x) view.valid[50 * y + x] = 1;
  const SurveyedView found = survey_views(data).front();
  CHECK(found.thumbnail == plain.thumbnail);
  CHECK(found.valid == 0.5);
  CHECK((found.width == 60 && found.height == 40 && found.camera.width == 30 && found.camera.height == 20));
}

TEST_CASE(
    "data_survey: a held-out view is a twin if its image is a training image, or nearly so from there") {
  Dataset train = objects_scene(), test = objects_scene();
  test.split = "test";
  const auto find = [&] { return twins(survey_views(train), survey_views(test)); };
  for (std::size_t i = 0; i < train.views.size(); ++i) {
    train.views[i].name = "r_" + std::to_string(i);
    if (i % 2 == 0) train.views[i] = train.views[1];
  }
  test.views = {objects_scene().views[0], objects_scene().views[3], objects_scene().views[4]};
  test.views[0].name = "a", test.views[1].name = "b", test.views[2].name = "c";
  const Oddity same = only(find(), "twins");
  CHECK(same.images == Names{"test/b"});
  CHECK(same.partners == Names{"train/r_3"});
  CHECK(
      same.text ==
      "1 of 3 held-out images the same as a training image, or nearly so, the first is test/b, as train/r_3");
  // The same image in another file, from the same camera and from one slightly to the side.
  disturb(test.views[1], 0.008);
  CHECK(only(find(), "twins").images == Names{"test/b"});
  test.views[1].camera.pose[3] += 0.02;
  CHECK(only(find(), "twins").images == Names{"test/b"});
  // Similar images from other cameras: a sphere looks the same from all sides.
  test.views[1].camera.pose[3] += 2;
  CHECK(find().empty());
  test.views[1].camera.pose[3] -= 2;
  disturb(test.views[1], 0.1);
  CHECK(find().empty());
}

TEST_CASE("data_survey: cameras without an image, and images without a camera") {
  TrainingImages scene;
  CHECK(odd_files(scene.path, 0).empty());
  fs::remove(scene.image(2));
  fs::remove(scene.image(8));
  const Oddity missing = only(odd_files(scene.path, 0), "cameras_without_image");
  CHECK(missing.count == 2);
  CHECK_THAT(missing.text,
             Contains("2 cameras without an image, the first is that of ") && Contains("images/2.png"));
  for (const int i : {2, 8}) write_image(scene.image(i), 12, 8);
  write_image(scene.path / "images/14.png", 12, 8);
  const Oddity unused = only(odd_files(scene.path, 0), "images_without_camera");
  CHECK_THAT(unused.text, Contains("1 image without a camera, the first is ") && Contains("images/14.png"));
  CHECK_THROWS_AS(odd_files(scene.path / "none", 0), IoError);
}

TEST_CASE("data_survey: odd images and odd cameras are told together") {
  auto views = ring_of_views(11);
  views[3].camera.cx = -5;
  const auto found = odd_views(views, SceneType::object);
  REQUIRE(found.size() == 2);
  CHECK((found[0].kind == "few_views" && found[1].kind == "principal_points"));
}
