#include <fieldmark/core/files.h>
#include <fieldmark/engine/isa.h>

#include <nlohmann/json.hpp>
#include <set>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/gradcheck_cases.h"
#include "support/source_dir.h"
#include "support/temporary_folder.h"
#include "support/worst.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("gradcheck passes for every registered op and says which is the worst", "[gradcheck]") {
  const auto r = run_command({"gradcheck", "--json", "-"});
  INFO(r.err);
  CHECK(r.code == cli::kOk);
  const nlohmann::json json = nlohmann::json::parse(r.out);
  CHECK(json["ok"] == true);
  CHECK(json["worst"].get<double>() <= 1e-7);
  CHECK_THAT(r.err, Contains("worst relative error") && Contains(json["worst_case"].get<std::string>()));
  long entries = 0;
  double worst = 0;
  for (const auto& row : json["cases"]) {
    CHECK(row["ok"] == true);
    CHECK_THAT(r.err, Contains(row["name"].get<std::string>()));
    entries += row["entries"].get<long>();
    raise_to(worst, row["worst"].get<double>());
  }
  CHECK(entries == json["entries"].get<long>());
  CHECK(worst == json["worst"].get<double>());
}

TEST_CASE("gradcheck --only runs what has the text in its name", "[gradcheck]") {
  const TemporaryFolder folder;
  const std::string path = folder / "g.json";
  const auto r = run_command({"gradcheck", "--only", "rays", "--json", path});
  CHECK(r.code == cli::kOk);
  const nlohmann::json json = nlohmann::json::parse(read_text(path));
  CHECK(json["cases"].size() >= 1);
  for (const auto& row : json["cases"]) CHECK_THAT(row["name"].get<std::string>(), Contains("rays"));
}

TEST_CASE("gradcheck --only with an unknown text is a usage error", "[gradcheck]") {
  const auto r = run_command({"gradcheck", "--only", "no such op"});
  CHECK(r.code == cli::kUsage);
  CHECK(r.err ==
        "fieldmark: gradcheck: --only: no check has 'no such op' in its name (see fieldmark gradcheck "
        "--help)\n");
}

TEST_CASE("Every unit that is documented as differentiable has a check that begins with its stem",
          "[gradcheck]") {
  const nlohmann::json cases = nlohmann::json::parse(run_command({"gradcheck", "--json", "-"}).out)["cases"];
  int units = 0;
  for (const char* module : {"engine", "imaging", "nerf", "distort", "extractor", "watermark", "baselines"}) {
    const std::filesystem::path headers = source_dir() + "/" + module;
    if (!std::filesystem::exists(headers)) continue;
    for (const auto& file : std::filesystem::recursive_directory_iterator(headers)) {
      if (file.path().extension() != ".h" ||
          read_text(file.path()).find("Differentiable in:") == std::string::npos)
        continue;
      const std::string stem = file.path().stem().string();
      INFO(module << "/" << stem << " has no entry in gradcheck_cases()");
      CHECK(std::any_of(cases.begin(), cases.end(), [&](const nlohmann::json& row) {
        return row["module"] == module && begins_with_word(row["name"], stem);
      }));
      ++units;
    }
  }
  CHECK(units == 68);
}

TEST_CASE("gradcheck --numerics: every hard case within its limit, on each instruction set, also as a report",
          "[gradcheck]") {
  const TemporaryFolder folder;
  const auto r = run_command({"gradcheck", "--numerics", "--json", "-", "--report", folder / "numerics.md"});
  INFO(r.err);
  CHECK(r.code == cli::kOk);
  const nlohmann::json json = nlohmann::json::parse(r.out);
  CHECK(json["ok"] == true);
  std::set<std::string> modules;
  for (const auto& row : json["cases"]) {
    modules.insert(row["module"].get<std::string>());
    CHECK(row["ok"] == true);
    CHECK(row["v2"].get<double>() <= row["limit"].get<double>());
    CHECK(row["numbers"].get<long>() > 0);
    CHECK(row.contains("v3") == (isa_supported() >= Isa::v3));
  }
  CHECK(modules == std::set<std::string>{"distort", "engine", "extractor", "imaging", "nerf", "watermark"});
  CHECK_THAT(read_text(folder / "numerics.md"), Contains("composite: a last interval of 1e10"));
  CHECK(run_command({"gradcheck", "--numerics", "--only", "no such case"}).code == cli::kUsage);
}
