#include "cli/kept_readings.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <algorithm>
#include <cmath>

#include "cli/cli.h"
#include "support/catch.h"
#include "tools/tiny_job.h"

using namespace fieldmark;
using cli::KeptReadings;

namespace {

cli::ImageEvidence informed_of_three_cells() {
  cli::ImageEvidence read{.cells = {0.1, -1e-300, 3}, .sha256 = "abc", .width = 5, .height = 7};
  read.reading = watermark::ReadingKind::informed;
  read.agreement = 0.75;
  return read;
}

std::ptrdiff_t lines(const std::string& file) { return std::ranges::count(read_text(file), '\n'); }

}  // namespace

TEST_CASE("kept_readings: what was added is there again, digit for digit") {
  const TemporaryFolder folder;
  const std::string file = folder / "readings";
  {
    KeptReadings kept(file, "owner", "auto", 3);
    kept.add(informed_of_three_cells());
    kept.add({.cells = {2, 0, 1}, .sha256 = "def"});
  }
  const KeptReadings again(file, "owner", "auto", 3);
  CHECK(again.size() == 2);
  CHECK(!again.find("other"));
  const auto informed = again.find("abc"), blind = again.find("def");
  REQUIRE((informed && blind));
  CHECK(informed->cells == informed_of_three_cells().cells);
  CHECK(informed->reading == watermark::ReadingKind::informed);
  CHECK(informed->agreement == 0.75);
  CHECK((informed->width == 5 && informed->height == 7));
  CHECK(std::isnan(blind->agreement));
  CHECK(blind->reading == watermark::ReadingKind::blind);
}

TEST_CASE(
    "kept_readings: a line that was cut off is dropped, and the file goes on behind the last whole one") {
  const TemporaryFolder folder;
  const std::string file = folder / "readings";
  KeptReadings(file, "owner", "blind", 3).add({.cells = {2, 0, 1}, .sha256 = "def"});
  const std::string whole = read_text(file);
  write_file_atomically(file, whole + R"({"sha256": "abc", "cel)");
  KeptReadings kept(file, "owner", "blind", 3);
  CHECK(kept.size() == 1);
  CHECK(read_text(file) == whole);
  kept.add(informed_of_three_cells());
  CHECK(KeptReadings(file, "owner", "blind", 3).size() == 2);
}

TEST_CASE("kept_readings: other files stay as they are, and other runs are refused") {
  const TemporaryFolder folder;
  const std::string file = folder / "readings";
  KeptReadings(file, "owner", "blind", 3).add({.cells = {2, 0, 1}, .sha256 = "def"});
  CHECK_THROWS_WITH(KeptReadings(file, "another", "blind", 3), Contains(file) && Contains("owner_sha256"));
  CHECK_THROWS_WITH(KeptReadings(file, "owner", "auto", 3), Contains("detection"));
  std::string of_others = read_text(file);
  const std::string key = "\"commit\":\"";
  REQUIRE(of_others.find(key) != std::string::npos);
  of_others.insert(of_others.find(key) + key.size(), "0");
  write_file_atomically(file, of_others);
  CHECK_THROWS_WITH(KeptReadings(file, "owner", "blind", 3), Contains("has readings with commit"));
  for (const char* text : {"secret", "secret\n", "{\"readings\": 2}\n", "[]\n"}) {
    write_file_atomically(file, std::string_view(text));
    CHECK_THROWS_AS(KeptReadings(file, "owner", "blind", 3), IoError);
    CHECK(read_text(file) == text);
  }
  KeptReadings(folder / "new", "owner", "blind", 3);
  write_file_atomically(folder / "new", read_text(folder / "new") + "{\"sha256\": 5}\n");
  CHECK_THROWS_WITH(KeptReadings(folder / "new", "owner", "blind", 3), Contains("line 2"));
  KeptReadings(folder / "short", "owner", "blind", 1).add({.cells = {2}, .sha256 = "def"});
  CHECK_THROWS_WITH(KeptReadings(folder / "short", "owner", "blind", 3), Contains("1 cells, the owner 3"));
  CHECK_THROWS_AS(KeptReadings(folder / "no" / "folder", "owner", "blind", 3), IoError);
}

TEST_CASE("kept_readings: a run that was stopped goes on, with the results of an undisturbed one") {
  const TinyJob& job = TinyJob::get();
  const std::string images = job.images(), file = job.folder / "readings";
  const auto extract = [&] {
    const auto r = run_command(
        {"extract", "--owner", job.owner, "--fpr", "1", images, "--readings", file, "--json", "-"});
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    return r;
  };
  // Returns the result without the time of detection.
  const auto found = [](const Outcome& r) {
    auto json = nlohmann::json::parse(r.out);
    CHECK(json.erase("seconds_per_image") == 1);
    return json;
  };
  const auto first = extract();
  REQUIRE(lines(file) == 3);
  std::string text = read_text(file);
  text.resize(text.rfind('\n', text.size() - 2) + 20);
  write_file_atomically(file, text);
  const auto second = extract();
  CHECK(found(second) == found(first));
  CHECK_THAT(second.err, Contains("readings of 1 images"));
  CHECK(lines(file) == 3);
  const auto third = extract();
  CHECK(found(third) == found(first));
  CHECK(nlohmann::json::parse(second.out)["seconds_per_image"].is_number());
  CHECK(nlohmann::json::parse(third.out)["seconds_per_image"].is_null());
  const auto other = run_command(
      {"extract", "--owner", job.owner, "--fpr", "1", images, "--readings", file, "--detection", "blind"});
  CHECK(other.code == cli::kUsage);
  CHECK_THAT(other.err, Contains("detection"));
  const auto record = run_command({"verify", "--owner", job.owner, "--message", "a", images, "--readings",
                                   file, "--evidence", job.folder / "evidence"});
  CHECK(record.code == cli::kUsage);
  CHECK(!std::filesystem::exists(job.folder / "evidence"));
}
