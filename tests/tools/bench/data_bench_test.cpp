#include <fieldmark/tools/bench/data_bench.h>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

TEST_CASE("data_bench: every form takes the steps of the plain one, whose loss is 0") {
  const nerf::SceneOptions options{.size = 24, .views = 8};
  DataGroup group = object_forms(nerf::make_scene(options, "train"), nerf::make_scene(options, "test"));
  group.forms.resize(3);
  std::vector<std::string> told;
  const auto rows = run_data_bench(group, 0.5, 1, [&](const std::string& name, double part) {
    if (told.empty() || told.back() != name) told.push_back(name);
    CHECK(part >= 0);
    CHECK(part <= 1);
  });
  REQUIRE(rows.size() == 3);
  CHECK(told == std::vector<std::string>{"with alpha", "opaque before white", "moved by 500 km"});
  for (const DataRow& row : rows) {
    CHECK(row.steps == rows[0].steps);
    CHECK(row.psnr > 5);
    CHECK(row.loss == rows[0].psnr - row.psnr);
  }
  CHECK(rows[0].steps > 0);
  CHECK(rows[0].loss == 0);
  CHECK(rows[1].type == nerf::SceneType::plain);
  CHECK(std::abs(rows[2].loss) < 1);
}

TEST_CASE("data_bench: lenses are judged before the background of their images") {
  DataGroup group = lens_forms({.size = 32, .views = 12});
  group.forms.resize(2);
  for (const DataRow& row : run_data_bench(group, 1, 1, {})) {
    CAPTURE(row.form);
    CHECK(row.type == nerf::SceneType::object);
    CHECK(row.psnr > 12);
  }
}
