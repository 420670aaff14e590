#include <fieldmark/core/error.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/data_report.h>

#include "nerf/format_samples.h"
#include "nerf/training_images.h"
#include "support/data.h"
#include "vec3.h"

using namespace fieldmark;
using namespace fieldmark::nerf;
namespace fs = std::filesystem;

namespace {
std::string kinds(const DataReport& report) {
  std::string all;
  for (const Oddity& o : report.oddities) all += o.kind + " ";
  return all;
}
}  // namespace

TEST_CASE("data_report: a built-in scene has nothing odd, and its cameras stand as they were made") {
  const TemporaryFolder folder;
  write_scene({.size = 24, .views = 30}, folder.path / "s");
  std::vector<double> done;
  const DataReport report = report_data(folder.path / "s", {}, [&](double share) {
    done.push_back(share);
    return true;
  });
  CHECK(kinds(report) == "");
  CHECK((report.name == "s" && report.layout == Layout::blender && report.scene == SceneType::object));
  CHECK_THAT(report.scene_reason, Contains("of the pixels at the images' borders are transparent"));
  CHECK(report.background == Background::white);
  REQUIRE(report.sizes.size() == 1);
  CHECK((report.sizes[0].width == 24 && report.sizes[0].height == 24 && report.sizes[0].count == 40));
  REQUIRE(report.splits.size() == 3);
  CHECK((report.splits[0].images == 30 && report.splits[1].images == 3 && report.splits[2].images == 7));
  CHECK(report.splits[2].same_as.empty());
  CHECK(report.cameras.size() == 40);
  CHECK(norm(report.centre) == Approx(0).margin(1e-6));
  CHECK(report.up[2] == Approx(1).margin(1e-6));
  for (const double d : report.distances) CHECK(d == Approx(4.0311).epsilon(1e-4));
  CHECK((report.spread > 90 && report.spread <= 180));
  for (const double v : report.fields_of_view) CHECK(v == Approx(0.6911 * 57.29578).epsilon(1e-3));
  CHECK(done == std::vector<double>{0.75, 0.825, 1});
  const DataReport ended = report_data(folder.path / "s", {}, [](double) { return false; });
  CHECK((ended.cameras.empty() && ended.sizes.empty()));
}

TEST_CASE("data_report: oddities of a transforms.json, its splits, masks and notes") {
  TrainingImages scene;
  fs::remove(scene.image(8));
  write_image(scene.path / "images/extra.png", 12, 8);
  fs::copy_file(scene.image(2), scene.image(3), fs::copy_options::overwrite_existing);
  fs::copy_file(scene.image(4), scene.image(0), fs::copy_options::overwrite_existing);
  write_png(scene.path / "black.png", Tensor<float>({8, 12, 3}));
  scene.frame(5)["mask_path"] = "black.png";
  scene.write();
  const DataReport report = report_data(scene.path);
  CHECK(kinds(report) == "duplicates masks few_views twins cameras_without_image images_without_camera ");
  CHECK(report.layout == Layout::transforms);
  CHECK(report.masked_images == 1);
  REQUIRE(report.splits.size() == 3);
  CHECK((report.splits[0].images == 8 && report.splits[0].missing == 0));
  CHECK((report.splits[2].images == 1 && report.splits[2].missing == 1 && report.splits[2].same_as.empty()));
  CHECK(report.splits[1].same_as == "test");
  CHECK(report.cameras.size() == 9);
  CHECK_THAT(report.notes.front(), Contains("every 8th of 10 images is held out"));
}

TEST_CASE("data_report: forward-facing scenes, and what cannot be loaded") {
  const TemporaryFolder folder;
  write_file_atomically(folder.path / "poses_bounds.npy", std::string_view(llff_file(llff_rows(8))));
  for (int i = 0; i < 8; ++i)
    write_image(folder.path / "images" / ("p" + std::to_string(i) + ".png"), 80, 60,
                static_cast<unsigned>(i));
  const DataReport report = report_data(folder.path);
  CHECK(kinds(report) == "");
  CHECK(report.scene == SceneType::forward);
  CHECK(report.centre[2] < 0);
  CHECK(report.spread < 180);
  CHECK(report_data(folder.path, {.size = 40}).sizes[0].width == 80);
  CHECK(report_data(folder.path, {.size = 40}).cameras[0].camera.width == 40);
  CHECK_THROWS_AS(report_data(folder.path / "none"), IoError);
  const TemporaryFolder test_only;
  write_scene({.size = 8, .views = 10}, test_only.path);
  fs::remove(test_only.path / "transforms_train.json");
  CHECK_THROWS_WITH(report_data(test_only.path), Contains("transforms_train.json"));
  CHECK((name_of(Layout::llff) == "llff" && name_of(Layout::colmap) == "colmap"));
}

TEST_CASE("data_report: the public scenes have nothing odd") {
  for (const char* name : {"fox", "nerf_llff/fern"}) {
    const auto folder = data_or_skip(name, "data_report: " + std::string(name));
    if (!folder) continue;
    INFO(name);
    CHECK(kinds(report_data(*folder, {.size = 100})) == "");
  }
}
