#include "odd_images.h"

#include "nerf/surveyed.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
using Names = std::vector<std::string>;

namespace {
void brighten(SurveyedView& view, float by) {
  for (std::size_t i = 0; i < view.thumbnail.size(); ++i)
    if (i % 4 != 3) view.thumbnail[i] *= by;
}
}  // namespace

TEST_CASE("odd_images: enough views of different images of one size are not odd") {
  CHECK(odd_images(ring_of_views(12), SceneType::object).empty());
  CHECK(odd_images(ring_of_views(6), SceneType::forward).empty());
  CHECK(odd_images({}, SceneType::place).empty());
}

TEST_CASE("odd_images: equal images to train on, each with its first, and blank ones are told of as such") {
  auto views = ring_of_views(14);
  views[3].thumbnail = views[9].thumbnail = views[1].thumbnail;
  views[12].thumbnail = views[2].thumbnail, views[12].split = "test";
  const Oddity same = only(odd_images(views, SceneType::place), "duplicates");
  CHECK(same.count == 2);
  CHECK(same.text == "2 of 13 training images equal to another one, the first is train/3, as train/1");
  CHECK(same.images == Names{"train/3", "train/9"});
  CHECK(same.partners == Names{"train/1", "train/1"});
  views = ring_of_views(14);
  for (const std::size_t i : {5, 6}) views[i].thumbnail.assign(4096, 0.25f);
  const Oddity blank = only(odd_images(views, SceneType::place), "blank_images");
  CHECK(blank.text == "2 of 14 images of one colour throughout, the first is train/5");
  CHECK(!same_image(views[5], views[6]));
}

TEST_CASE("odd_images: another size than most, and masks that leave little") {
  auto views = ring_of_views(13);
  views[4].width = 30, views[4].height = 40;
  views[7].width = 80, views[7].height = 60;
  const Oddity sizes = only(odd_images(views, SceneType::place), "sizes");
  CHECK(sizes.text == "2 of 13 images of another size than 40 x 30 pixels, the first is train/4");
  views = ring_of_views(13);
  views[2].valid = 0.1, views[3].valid = 0.099, views[8].valid = std::nan("");
  const Oddity masks = only(odd_images(views, SceneType::place), "masks");
  CHECK(masks.images == Names{"train/3", "train/8"});
  CHECK(masks.text == "2 of 13 images of which masks leave less than a tenth, the first is train/3");
}

TEST_CASE("odd_images: exposures that differ between neighbours at every quartile") {
  const auto alternating = [](float by) {
    auto views = ring_of_views(40);
    for (std::size_t i = 0; i < views.size(); i += 2) brighten(views[i], by);
    return views;
  };
  const Oddity mixed = only(odd_images(alternating(1.4f), SceneType::object), "exposures");
  CHECK(mixed.count == 40);
  CHECK_THAT(mixed.text,
             Contains("40 of 40 images of another brightness than the one next to them, up to 1.4"));
  CHECK(mixed.partners.size() == 40);
  CHECK(only(odd_images(alternating(1.2f), SceneType::place), "exposures").count == 40);
  CHECK(odd_images(alternating(1.2f), SceneType::plain).empty());
  CHECK(odd_images(alternating(1.1f), SceneType::place).empty());
  // A bright quarter of an image is content, and so is a different brightness far away.
  auto views = ring_of_views(40);
  std::fill_n(views[0].thumbnail.begin(), 1024, 1.f);
  CHECK(odd_images(views, SceneType::place).empty());
  views = ring_of_views(14);
  brighten(views[0], 1.6f);
  CHECK(odd_images(views, SceneType::place).empty());
  // If all poses are equal, no camera has a neighbour.
  views = alternating(1.4f);
  for (auto& v : views) v.camera = views[0].camera;
  CHECK(odd_images(views, SceneType::place).empty());
  // Without opaque cells there is nothing to compare.
  views = alternating(1.4f);
  for (auto& v : views)
    for (std::size_t i = 3; i < v.thumbnail.size(); i += 4) v.thumbnail[i] = 0.25f;
  CHECK(odd_images(views, SceneType::object).empty());
}

TEST_CASE("odd_images: few views to train on") {
  const Oddity few = only(odd_images(ring_of_views(11), SceneType::object), "few_views");
  CHECK(few.count == 11);
  CHECK(few.text == "only 11 images to train on");
  CHECK(only(odd_images(ring_of_views(1), SceneType::object), "few_views").text ==
        "only 1 image to train on");
  CHECK(only(odd_images(ring_of_views(5), SceneType::forward), "few_views").count == 5);
  auto views = ring_of_views(20);
  for (std::size_t i = 0; i < 12; ++i) views[i].split = "test";
  CHECK(only(odd_images(views, SceneType::place), "few_views").count == 8);
}

TEST_CASE("odd_images: the neighbour is the nearest camera that looks the same way") {
  auto views = ring_of_views(36);
  for (const std::size_t i : {0, 7, 35}) {
    const std::size_t next = neighbours(views)[i];
    CHECK((next == (i + 1) % 36 || next == (i + 35) % 36));
  }
  CHECK(neighbours(ring_of_views(4)) == std::vector<std::size_t>{0, 1, 2, 3});  // 90 degrees apart
}
