#include <fieldmark/core/files.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("bench turns: needs another build and a command, and says what is wrong with them", "[bench]") {
  CHECK(run_command({"bench", "turns", "--", "info", "x"}).code == cli::kUsage);
  const auto none = run_command({"bench", "turns", "--against", "/nowhere/fieldmark"});
  CHECK(none.code == cli::kUsage);
  CHECK_THAT(none.err, Contains("command"));
  const TemporaryFolder folder;
  const auto program = folder / "other";
  write_file_atomically(program, "#!/bin/sh\nexit 1\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  // This test program stands for this build: with --libidentify it ends with exit code 0.
  const auto failed = run_command({"bench", "turns", "--against", program.string(), "--runs", "1", "--limit",
                                   "60", "--", "--libidentify"});
  CHECK(failed.code == cli::kFailed);
  CHECK_THAT(failed.err, Contains(program.string() + ": ended with exit code 1"));
}

TEST_CASE("bench turns: seconds of both builds and their ratio as JSON", "[bench]") {
  const TemporaryFolder folder;
  const auto program = folder / "other";
  write_file_atomically(program, "#!/bin/sh\ntest \"$1\" = --libidentify || exit 1\nexec sleep 0.1\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const auto r = run_command(
      {"bench", "turns", "--against", program.string(), "--runs", "2", "--json", "-", "--", "--libidentify"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  const auto json = nlohmann::json::parse(r.out);
  CHECK(json["arguments"] == nlohmann::json{"--libidentify"});
  CHECK(json["runs"] == 2);
  REQUIRE(json["seconds"].size() == 2);
  REQUIRE(json["seconds_against"].size() == 2);
  const auto pair = [&](int i) {
    return json["seconds"][i].get<double>() / json["seconds_against"][i].get<double>();
  };
  CHECK(json["ratio"].get<double>() == Approx((pair(0) + pair(1)) / 2));
  CHECK(json["ratio_range"][0] == Approx(std::min(pair(0), pair(1))));
  CHECK(json["ratio_range"][1] == Approx(std::max(pair(0), pair(1))));
  CHECK(json["seconds_against"][0] >= 0.1);
}
