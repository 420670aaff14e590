#include <fieldmark/baselines/cell.h>
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/core/files.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/paper_cells.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("reproduce measures what is missing on the built-in scene, once", "[reproduce]") {
  const TemporaryFolder folder;
  const std::vector<std::string> line{"reproduce",
                                      "--table",
                                      "weights",
                                      "--scene",
                                      "objects",
                                      "--budget",
                                      "0.1",
                                      "--size",
                                      "32",
                                      "--views",
                                      "1",
                                      "--truth-images",
                                      "1",
                                      "--base-seconds",
                                      "0.3",
                                      "--log2-table",
                                      "9",
                                      "--cells",
                                      folder / "cells",
                                      "--work",
                                      folder / "work",
                                      "--json",
                                      "-",
                                      "--lpips-weights",
                                      "none"};
  auto there = paper_cells().front();  // one of the two cells of the table has been measured
  there.name = {"copyrnerf_paper", "objects", "hash", 8, 1};
  save_cell(folder / "cells", there);
  const auto first = run_command(line);
  INFO(first.err);
  REQUIRE(first.code == cli::kOk);
  CHECK_THAT(first.err, Contains("1 of 2 cells are missing, about") && Contains("ours-objects-hash-8-1: ") &&
                            Contains("paper.md: written"));
  CHECK(nlohmann::json::parse(first.out)["missing"].empty());
  const auto cells = baselines::load_cells(folder / "cells");
  REQUIRE(cells.size() == 2);
  CHECK(cells[1].name == baselines::CellName{"ours", "objects", "hash", 8, 1});
  CHECK(cells[1].more.at("total_seconds") > 0);
  CHECK(cells[1].under.contains("weights_0.01"));
  CHECK_THAT(read_text(folder / "paper.md"), Contains("| Fieldmark, preset fast | objects | hash |"));
  CHECK(std::filesystem::exists(folder / "paper_bits.svg"));
  CHECK(std::filesystem::exists(folder / "work/size-32/table-9"));  // apart from fields of other sizes

  const std::string kept = read_text(folder / "cells/ours-objects-hash-8-1.json");
  CHECK(nlohmann::json::parse(kept)["id"] == "paper/ours-objects-hash-8-1");
  const auto second = run_command(line);
  CHECK(second.code == cli::kOk);
  CHECK_THAT(second.err, Contains("0 of 2 cells are missing\n"));
  CHECK(read_text(folder / "cells/ours-objects-hash-8-1.json") == kept);
  CHECK_THAT(second.err, Contains("cells of other budgets are kept, 1;"));

  std::vector<std::string> other = line;
  *std::ranges::find(other, "0.1") = "0.2";
  const auto kept_cells = run_command(other);
  CHECK(kept_cells.code == cli::kOk);
  CHECK_THAT(kept_cells.err, Contains("cells of other budgets are kept, 2; for cells of 0.2 s name another "
                                      "folder with --cells"));

  std::vector<std::string> longer = line;
  *std::ranges::find(longer, (folder / "cells").string()) = folder / "cells/longer";
  longer.insert(longer.end(), {"--system", "ours"});
  const auto third = run_command(longer);
  INFO(third.err);
  REQUIRE(third.code == cli::kOk);
  CHECK(nlohmann::json::parse(read_text(folder / "cells/longer/ours-objects-hash-8-1.json"))["id"] ==
        "paper/longer/ours-objects-hash-8-1");
}

TEST_CASE("reproduce --report-only writes the page from the cells that are there", "[reproduce]") {
  const TemporaryFolder folder;
  for (const auto& cell : paper_cells()) save_cell(folder / "cells", cell);
  const auto r = run_command({"reproduce", "--report-only", "--table", "bits", "--scene", "lego", "--cells",
                              folder / "cells", "--report", folder / "page.md", "--budget", "60"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  CHECK_THAT(r.out, Contains(" cells are missing, about ") && Contains("  ours-lego-hash-48-1\n") &&
                        !Contains("  ours-lego-hash-16-1\n"));
  CHECK_THAT(read_text(folder / "page.md"), Contains("98.44 ± 0.62"));
  CHECK(!std::filesystem::exists(folder / "work"));
}

TEST_CASE("reproduce shows cells of a longer budget on the page of the folder that they are in",
          "[reproduce]") {
  const TemporaryFolder folder;
  auto cells = paper_cells();
  for (const auto& cell : cells) save_cell(folder / "cells", cell);
  REQUIRE(cells[1].name == baselines::CellName{"copyrnerf_paper", "lego", "hash", 16, 1});
  cells[1].bit_accuracy = 0.5625;
  save_cell(folder / "cells/longer", cells[1]);
  const auto r = run_command({"reproduce", "--report-only", "--table", "bits", "--system", "copyrnerf_paper",
                              "--scene", "lego", "--cells", folder / "cells/longer/"});
  INFO(r.err);
  REQUIRE(r.code == cli::kOk);
  // Only the subfolder's cells count as measured: that of 4 bits is in the folder above.
  CHECK_THAT(r.out, Contains("  copyrnerf_paper-lego-hash-4-1\n") &&
                        !Contains("  copyrnerf_paper-lego-hash-16-1\n"));
  CHECK_THAT(read_text(folder / "paper.md"),
             Contains("98.44 ± 0.62") && Contains("## Longer budgets") && Contains("56.25 ± 0.62"));
  CHECK(!std::filesystem::exists(folder / "cells/paper.md"));
}

TEST_CASE("reproduce has every system once before it turns to other lengths and scenes", "[reproduce]") {
  const TemporaryFolder folder;
  const auto r = run_command({"reproduce", "--report-only", "--scene", "lego", "--scene", "chair", "--cells",
                              folder / "cells", "--json", "-"});
  REQUIRE(r.code == cli::kOk);
  const auto missing = nlohmann::json::parse(r.out)["missing"].get<std::vector<std::string>>();
  std::set<std::string> systems;
  for (const auto& s : baselines::paper_systems()) systems.insert(s.name);
  std::size_t cells = 0;
  while (!systems.empty() && cells < missing.size()) {
    CHECK(!missing[cells].ends_with("-48-1"));
    CHECK(missing[cells].find("-lego-") != std::string::npos);
    systems.erase(missing[cells].substr(0, missing[cells].find('-')));
    ++cells;
  }
  CHECK(systems.empty());
  CHECK(cells <= 18);
  CHECK(missing.back().find("-chair-") != std::string::npos);
}

TEST_CASE("reproduce --system keeps to the rows that are named", "[reproduce]") {
  const TemporaryFolder folder;
  const auto r = run_command({"reproduce", "--report-only", "--table", "bits", "--system", "ours", "--system",
                              "geometry", "--scene", "lego", "--cells", folder / "cells", "--json", "-"});
  REQUIRE(r.code == cli::kOk);
  const auto missing = nlohmann::json::parse(r.out)["missing"].get<std::vector<std::string>>();
  CHECK(missing.size() == 10);
  for (const auto& stem : missing) CHECK((stem.starts_with("ours-") || stem.starts_with("geometry-")));
}

TEST_CASE("reproduce says what is wrong", "[reproduce]") {
  const TemporaryFolder folder;
  const auto table = run_command({"reproduce", "--table", "best", "--cells", folder / "cells"});
  CHECK(table.code == cli::kUsage);
  CHECK_THAT(table.err, Contains("--table: name must be bits, quality"));
  const auto system = run_command({"reproduce", "--system", "theirs", "--cells", folder / "cells"});
  CHECK(system.code == cli::kUsage);
  CHECK_THAT(system.err, Contains("--system: name must be one of ours, copyrnerf_paper"));
  const auto scene = run_command({"reproduce", "--table", "weights", "--scene", folder / "nowhere", "--cells",
                                  folder / "cells", "--work", folder / "work", "--lpips-weights", "none"});
  CHECK(scene.code == cli::kFailed);
  CHECK_THAT(scene.err, Contains("nowhere: expected the folder of a data set"));
  CHECK(!std::filesystem::exists(folder / "work"));  // refused before any cell is measured
  const auto twice = run_command({"reproduce", "--table", "weights", "--scene", folder / "a/lego", "--scene",
                                  folder / "b/lego", "--report-only", "--cells", folder / "cells"});
  CHECK(twice.code == cli::kUsage);
  CHECK_THAT(twice.err, Contains("--scene: cells are named after scenes, got two called lego"));
  CHECK(run_command({"reproduce", "--budget", "0"}).code == cli::kUsage);
}
