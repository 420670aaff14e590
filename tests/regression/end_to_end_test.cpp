#include <map>
#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/test_key_file.h"

// Runs the whole job through the command on a scene of 48 x 48 pixels, from the data set to the verdict.
// Keys, seeds and steps are fixed, so every run on one instruction set gives the same p-values.

namespace {

constexpr int kFound = 0, kNotFound = 3;
constexpr double kRate = 1e-6;

struct EndToEnd {
  TemporaryFolder folder;
  std::string owner = folder / "owner", marked = folder / "marked", unmarked = folder / "unmarked";

  EndToEnd() {
    run({"scene", "--out", folder / "scene", "--size", "48", "--views", "40"});
    run({"train", "--data", folder / "scene", "--out", folder / "field", "--steps", "200", "--max-megabytes",
         "1"});
    run({"embed",
         "--field",
         folder / "field",
         "--out",
         owner,
         "--key",
         test_key_file(folder),
         "--bits",
         "8",
         "--mark-psnr",
         "26",
         "--cells",
         "6",
         "--reader-size",
         "48",
         "--steps",
         "50",
         "--views",
         "12",
         "--measured-views",
         "1"});
    run({"bake", "--owner", owner, "--message", "a6", "--out", folder / "baked", "--steps", "30"});
    for (const auto& [field, views] :
         std::map<std::string, std::string>{{"baked", marked}, {"field", unmarked}})
      run({"render", "--field", folder / field, "--out", views, "--cameras", "novel", "--count", "6",
           "--seed", "99", "--size", "48"});
  }

  static Outcome run(const std::vector<std::string>& words) {
    const Outcome outcome = run_command(words);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome;
  }

  // Verifies and returns the p-value, which must match the exit code.
  double p_value(const std::string& message, const std::string& views, int code,
                 const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words{"verify", "--owner", owner, "--message", message,
                                   "--fpr",  "1e-6",    views, "--json",    "-"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run_command(words);
    INFO(outcome.err);
    REQUIRE(outcome.code == code);
    const auto json = nlohmann::json::parse(outcome.out);
    CHECK(json.at("found") == (code == kFound));
    CHECK(json.at("views") == 6);
    return json.at("p_value");
  }
};

}  // namespace

TEST_CASE(
    "end to end: a mark is found, and is not on unmarked images, under another key or as another message") {
  const EndToEnd job;
  const double right = job.p_value("a6", job.marked, kFound);
  CHECK(right <= kRate);
  CHECK(right > 0);
  CHECK(job.p_value("a6", job.unmarked, kNotFound) > 1e-3);
  CHECK(job.p_value("c5", job.marked, kNotFound) > 1e-3);
  CHECK(job.p_value("a6", job.marked, kNotFound, {"--key", test_key_file(job.folder, 6)}) > 1e-3);
}
