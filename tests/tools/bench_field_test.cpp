#include <fieldmark/core/files.h>

#include <nlohmann/json.hpp>

#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("bench field renders a stored field in every way, and says where the default stands", "[bench]") {
  const TemporaryFolder folder;
  const std::string scene = tiny_scene(folder), field = tiny_field(folder, scene);
  const auto r = run_command({"bench", "field", "--field", field, "--size", "24", "--views", "2", "--runs",
                              "1", "--quick", "--json", "-", "--report", folder / "field.md", "--plot",
                              folder / "field.svg"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["field"] == "field.fm");
  CHECK(json["views"] == 2);
  CHECK(json["width"] == 24);
  CHECK(json["reference_samples"] == 1024);
  REQUIRE(json["rows"].size() > 5);
  CHECK(json["rows"][0]["knob"] == "default");
  bool on_front = false;
  for (const auto& row : json["rows"]) {
    for (const char* key : {"setting", "seconds", "psnr", "max_error", "dropped_mean", "dropped_max"})
      CHECK(row.contains(key));
    on_front = on_front || row["front"].get<bool>();
  }
  CHECK(on_front);
  CHECK(json["default_on_front"] == json["rows"][0]["front"]);
  for (const char* key : {"psnr", "dropped_mean", "dropped_max", "pixels"})
    CHECK(json["occupancy"].contains(key));
  CHECK_THAT(r.err, Contains("The default (") && Contains("on the front"));
  CHECK_THAT(read_text(folder / "field.md"), Contains("| judgement | The default (") && Contains("## rows"));
  const std::string svg = read_text(folder / "field.svg");
  CHECK_THAT(svg, Contains("field.fm: speed against error") && Contains("class=\"point\""));
}

TEST_CASE("bench field trains a field where none is given, and takes the test views of a data set",
          "[bench]") {
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "field", "--scene", tiny_scene(folder), "--seconds", "0.5", "--size",
                              "16", "--views", "1", "--runs", "1", "--quick", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["field"] == "scene");
}

TEST_CASE("bench field: what is not there", "[bench]") {
  CHECK_THAT(run_command({"bench", "field", "--field", "/nowhere/field.fm"}).err,
             Contains("/nowhere/field.fm"));
  CHECK(run_command({"bench", "field", "--size", "4"}).code == cli::kUsage);
  CHECK(run_command({"bench", "field", "--views", "0"}).code == cli::kUsage);
}
