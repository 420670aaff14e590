#include <fieldmark/core/files.h>

#include "tools/tiny_job.h"

using namespace fieldmark;

TEST_CASE("bench embed tells what is read against time and strength, and where the default stands",
          "[bench]") {
  const TinyJob& job = TinyJob::get();
  const TemporaryFolder folder;
  const auto r = run_command({"bench", "embed", "--field", job.field, "--seconds", "0.4", "--views", "3",
                              "--bits", "4", "--quick", "--json", "-", "--report", folder / "embed.md",
                              "--plot", folder / "embed.svg"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["field"] == "field.fm");
  CHECK(json["bits"] == 4);
  CHECK(json["views"] == 3);
  REQUIRE(json["rows"].size() == 4);
  CHECK(json["rows"][0]["choice"] == "default");
  CHECK(json["rows"][0]["difference"] == 0);
  CHECK(json["default_on_front"] == json["rows"][0]["front"]);
  bool on_front = false;
  for (const auto& row : json["rows"]) {
    CHECK(row["steps"] > 0);
    CHECK(row["seconds"] > row["view_seconds"]);
    for (const char* key : {"accuracy", "accuracy_p5", "closer", "farther", "extrapolated", "sign", "cell"})
      CHECK((row[key] >= 0 && row[key] <= 1));
    on_front = on_front || row["front"].get<bool>();
  }
  CHECK(on_front);
  CHECK(json["curves"].size() > 4);
  CHECK_THAT(r.err, Contains("The default reads"));
  CHECK_THAT(read_text(folder / "embed.md"),
             Contains("## rows") && Contains("## curves") && Contains("| judgement | The default reads"));
  CHECK_THAT(read_text(folder / "embed.svg"), Contains("class=\"point\"") && Contains("default"));
  CHECK_THAT(read_text(folder / "embed-curves.svg"), Contains("class=\"curve\""));
}

TEST_CASE("bench embed takes an owner's field, and only the rows that are asked for", "[bench]") {
  const TinyJob& job = TinyJob::get();
  const auto r = run_command({"bench", "embed", "--owner", job.owner, "--seconds", "0.2", "--views", "1",
                              "--bits", "4", "--quick", "--only", "distances: half", "--json", "-"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["field"] == "owner.fm");
  REQUIRE(json["rows"].size() == 2);
  CHECK(json["rows"][1]["choice"] == "distances");
}

TEST_CASE("bench embed: what is not there", "[bench]") {
  CHECK_THAT(run_command({"bench", "embed", "--field", "/nowhere/field.fm"}).err,
             Contains("/nowhere/field.fm"));
  CHECK(run_command({"bench", "embed", "--bits", "0"}).code == cli::kUsage);
}
