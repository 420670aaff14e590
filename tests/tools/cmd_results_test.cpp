#include <fieldmark/core/files.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/environment.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("results measures what is named, once, and renders it", "[results]") {
  const TemporaryFolder folder;
  const std::vector<std::string> line{"results", "--run",         "bench/numerics", "--draft",
                                      "--work",  folder / "work", "--json",         "-"};
  const auto first = run_command(line);
  INFO(first.err);
  REQUIRE(first.code == cli::kOk);
  CHECK(nlohmann::json::parse(first.out)["measured"] == 1);
  const std::string file = folder / "work/rows/bench/numerics.json", row = read_text(file);
  const auto json = nlohmann::json::parse(row);
  CHECK(json["command"] == "gradcheck --numerics");
  CHECK(json["result"]["ok"] == true);
  CHECK(json["code"].get<std::string>().size() == 64);
  for (const char* key :
       {"schema", "commit", "cpu", "isa", "threads", "compiler", "seed", "seconds", "inputs"})
    CHECK(json.contains(key));
  const auto second = run_command(line);
  CHECK(second.code == cli::kOk);
  const bool changed = json["commit"].get<std::string>().find("changes") != std::string::npos;
  CHECK(nlohmann::json::parse(second.out).value("measured", 0) == (changed ? 1 : 0));
  if (!changed) CHECK(read_text(file) == row);

  const auto page =
      run_command({"results", "--render", "--rows", folder / "work/rows", "--out", folder / "out"});
  INFO(page.err);
  REQUIRE(page.code == cli::kOk);
  CHECK_THAT(read_text(folder / "out/numerics.md"), Contains("exp from -87.3 to 88"));
  CHECK_THAT(read_text(folder / "out/README.md"), Contains("| - | [quality](quality.md) |"));
}

TEST_CASE("results resumes no checkpoint that another command, code or input made", "[results]") {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "work/job");
  const std::string checkpoint = folder / "work/job/lego-other.key.checkpoint";
  write_file_atomically(checkpoint, "of other code");
  const auto r = run_command({"results", "--run", "job/lego-key", "--draft", "--work", folder / "work"});
  INFO(r.err << r.out);
  CHECK(r.code == cli::kOk);  // a checkpoint would add --resume, which `key` refuses
  CHECK(!std::filesystem::exists(checkpoint));
  CHECK(std::filesystem::exists(folder / "work/job/lego-other.key"));
}

TEST_CASE("results lists every row with its state, and skips what has no data set", "[results]") {
  const TemporaryFolder folder;
  const auto list = run_command({"results", "--rows", folder / "rows", "--json", "-"});
  REQUIRE(list.code == cli::kOk);
  const auto rows = nlohmann::json::parse(list.out)["rows"];
  REQUIRE(rows.size() > 200);
  for (const auto& row : rows) CHECK((row["state"] == "missing" && row["reason"] == "not measured"));
  CHECK_THAT(list.err, Contains(" rows, 0 fresh"));
  const EnvironmentVariable without_data("FIELDMARK_DATA", nullptr);
  const auto skipped = run_command({"results", "--run", "fields/chair-sized", "--budget", "1", "--draft",
                                    "--work", folder / "work", "--json", "-"});
  CHECK(skipped.code == cli::kOk);
  CHECK(nlohmann::json::parse(skipped.out)["skipped"] == 1);
  CHECK_THAT(skipped.err, Contains("fields/chair-sized: skipped, FIELDMARK_DATA has no data set 'chair'"));
}

TEST_CASE("results says what is wrong", "[results]") {
  CHECK_THAT(run_command({"results", "--run", "nothing", "--draft"}).err,
             Contains("--run: no row of the plan"));
  CHECK(run_command({"results", "--run", "nothing", "--stale"}).code == cli::kUsage);
  CHECK(run_command({"results", "--budget", "0"}).code == cli::kUsage);
  CHECK_THAT(run_command({"results", "--run", "nothing", "--draft", "--rows", "rows"}).err,
             Contains("--draft: excludes --rows"));
}
