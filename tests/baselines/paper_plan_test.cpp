#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/core/error.h>

#include <algorithm>
#include <set>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {
bool has(const std::vector<CellName>& cells, const CellName& name) {
  return std::find(cells.begin(), cells.end(), name) != cells.end();
}
}  // namespace

TEST_CASE("paper_plan: what the tables of one scene are made of") {
  const PlanOptions lego{.scenes = {"lego"}, .seed = 4};
  const auto bits = plan_cells(PaperTable::bits, lego);
  for (const Index n : {4, 8, 16, 32, 48})
    for (const char* system : {"ours", "copyrnerf_paper", "nerf_message", "geometry"})
      CHECK(has(bits, {system, "lego", "hash", n, 4}));
  CHECK(has(plan_cells(PaperTable::quality, lego), {"copyrnerf_paper", "lego", "mlp", 16, 4}));
  CHECK(has(plan_cells(PaperTable::distortion, lego), {"without_drr", "lego", "hash", 16, 4}));
  CHECK(has(plan_cells(PaperTable::quality, lego), {"copyrnerf_code", "lego", "hash", 16, 4}));
  const auto ablation = plan_cells(PaperTable::ablation, lego);
  for (const char* system : {"cold_start", "without_drr", "without_mff", "without_cff", "drs",
                             "ours_without_dense", "ours_without_cells", "ours_without_signs"})
    CHECK(has(ablation, {system, "lego", "hash", 16, 4}));
  CHECK(plan_cells(PaperTable::sampling, lego).size() == 1);
  CHECK(has(plan_cells(PaperTable::weights, lego), {"copyrnerf_paper", "lego", "hash", 8, 4}));
}

TEST_CASE("paper_plan: other scenes have the main systems, --full has all and three seeds") {
  PlanOptions options{.scenes = {"lego", "chair"}};
  const auto quality = plan_cells(PaperTable::quality, options);
  CHECK(has(quality, {"copyrnerf_paper", "chair", "hash", 16, 1}));
  CHECK(!has(quality, {"copyrnerf_paper", "chair", "mlp", 16, 1}));
  CHECK(!has(quality, {"copyrnerf_paper", "lego", "hash", 16, 2}));
  options.full = true;
  const auto full = plan_cells(PaperTable::quality, options);
  CHECK(has(full, {"copyrnerf_paper", "chair", "mlp", 16, 1}));
  CHECK(has(full, {"copyrnerf_paper", "lego", "hash", 16, 3}));
  CHECK(has(plan_cells(PaperTable::bits, options), {"ours", "chair", "hash", 48, 2}));
}

TEST_CASE("paper_plan: every cell once, each of a system that is known") {
  for (const std::string_view table : paper_table_names())
    for (const bool full : {false, true}) {
      const auto cells =
          plan_cells(parse_paper_table(table), {.scenes = {"lego", "chair", "fern"}, .full = full});
      std::set<std::string> stems;
      for (const CellName& name : cells) {
        CHECK(paper_system(name.system).name == name.system);
        stems.insert(name.stem());
      }
      CHECK(!cells.empty());
      CHECK(stems.size() == cells.size());
    }
}

TEST_CASE("paper_plan: errors") {
  CHECK_THROWS_WITH(parse_paper_table("images"),
                    "[paper_table] name must be bits, quality, distortion, ablation, sampling or weights, "
                    "got images");
  CHECK_THROWS_WITH(plan_cells(PaperTable::bits, {}), "[plan_cells] scenes must not be empty");
  CHECK_THROWS_WITH(paper_system("x"), Contains("[paper_system] name must be one of ours, copyrnerf_paper") &&
                                           Contains(", got x"));
}
