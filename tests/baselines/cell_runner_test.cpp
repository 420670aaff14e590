#include <fieldmark/baselines/cell_runner.h>
#include <fieldmark/imaging/image.h>

#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {
CellRunnerOptions tiny(const TemporaryFolder& folder) {
  return {.scenes = {{"objects", ""}},
          .budget = 0.2,
          .base_seconds = 0.5,
          .hash = trainable_field_options(),
          .size = 32,
          .views = 2,
          .under_views = 1,
          .ground_truth = 2,
          .work = folder / "work",
          .under = {"noise_0.1"},
          .commit = "abc"};
}
}  // namespace

TEST_CASE("cell_runner: a cell of the built-in scene, from training to files") {
  const TemporaryFolder folder;
  auto options = tiny(folder);
  bool stopped = false;
  options.progress = [&](const std::string& what, double, const std::string&) {
    if (what != "ours-objects-hash-16-1" || stopped) return true;
    stopped = true;
    return false;
  };
  CellRunner runner(options);
  const CellName name{"ours", "objects", "hash", 16, 1};
  CHECK_THROWS_AS(runner.run(name), Stopped);
  const MeasuredCell measured = runner.run(name);
  CHECK(measured.cell.name == name);
  CHECK(measured.cell.steps >= 1);
  CHECK(measured.cell.under.contains("noise_0.1"));
  CHECK(measured.cell.psnr_base_foreground == Approx(34).margin(3));
  CHECK(std::isnan(measured.cell.own_2d_accuracy));
  CHECK(measured.cell.psnr_gt > 5);
  CHECK(measured.cell.more.at("test_images") == 2);
  CHECK(measured.cell.commit == "abc");
  CHECK(measured.image.shape == Shape{32, 64, 3});
  CHECK(!kept_curve(measured.cell).empty());
  // A run with another budget neither finds this run's networks nor resumes them.
  CHECK(std::filesystem::exists(folder / "work/0.2s-0.5s/ours-objects-hash-16-1.checkpoint"));
  options.budget = 0.4;
  CellRunner longer(options);
  CHECK(std::filesystem::is_empty(folder / "work/0.4s-0.5s"));
}

TEST_CASE("cell_runner: errors") {
  const TemporaryFolder folder;
  auto options = tiny(folder);
  CellRunner runner(options);
  CHECK_THROWS_WITH(runner.run({"ours", "lego", "hash", 16, 1}),
                    "[cell_runner] name.scene must be one of the scenes given, got lego");
  CHECK_THROWS_WITH(runner.run({"ours", "objects", "grid", 16, 1}),
                    "[cell_runner] name.field must be hash or mlp, got grid");
  CHECK_THROWS_WITH(runner.run({"other", "objects", "hash", 16, 1}),
                    Contains("[paper_system] name must be one of") && Contains("got other"));
  options.budget = 0;
  CHECK_THROWS_WITH(CellRunner(options),
                    "[cell_runner] budget, views and ground truth must be positive, got 0, 2 and 2");
  options.scenes.clear();
  CHECK_THROWS_WITH(CellRunner(options), "[cell_runner] scenes must not be empty");
}
