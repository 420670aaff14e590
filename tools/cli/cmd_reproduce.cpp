#include <fieldmark/baselines/cell_runner.h>
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/tools/results/paper_page.h>
#include <fieldmark/tools/results/rows.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/lpips.h"
#include "cli/shared_data.h"

namespace fieldmark::cli {
namespace {

constexpr const char* kBuiltIn = "objects";
// Published severities first (the authors' code squares that of noise), then some up to where reading fails.
constexpr const char* kUnder[] = {"noise_0.1",  "rotation_30", "scale_0.75", "blur_0.1",    "noise_0.01",
                                  "noise_0.02", "noise_0.05",  "noise_0.2",  "rotation_10", "rotation_60",
                                  "scale_0.5",  "blur_0.5",    "blur_1",     "blur_2"};

struct ReproduceArguments {
  std::vector<std::string> tables, scenes, systems;
  std::string cells = "docs/results/rows/paper", work = "reproduce_work", lpips_weights;
  double budget = 300, base_seconds = 0;
  Index size = 0, views = 0, ground_truth = 20;
  int log2_table = nerf::HashEncodingOptions{}.log2_table;
  bool full = false, report_only = false;
};

std::vector<baselines::PaperScene> scenes_of(const ReproduceArguments& options) {
  std::vector<baselines::PaperScene> scenes;
  for (const std::string& given : options.scenes) {
    const std::filesystem::path folder = std::filesystem::path(given).lexically_normal();
    if (given == kBuiltIn && !std::filesystem::exists(folder))
      scenes.push_back({kBuiltIn, {}});
    else
      scenes.push_back({(folder.has_filename() ? folder : folder.parent_path()).filename().string(), folder});
  }
  if (scenes.empty())
    for (const char* known : {"nerf_synthetic/lego", "nerf_synthetic/chair", "nerf_llff/fern"})
      if (const auto folder = shared_data(known); !folder.empty())
        scenes.push_back({folder.filename().string(), folder});
  if (scenes.empty()) scenes.push_back({kBuiltIn, {}});
  for (const auto& scene : scenes) {
    if (std::ranges::count(scenes, scene.name, &baselines::PaperScene::name) > 1)
      throw UsageError("--scene: cells are named after scenes, got two called " + scene.name);
    if (!options.report_only && !scene.folder.empty() && !std::filesystem::is_directory(scene.folder))
      throw IoError(scene.folder.string() + ": expected the folder of a data set, or " + kBuiltIn +
                    " for --scene");
  }
  return scenes;
}

// Fields of another size are not this run's: they are kept in a folder of their own.
std::filesystem::path work_of(const ReproduceArguments& options) {
  std::filesystem::path work = options.work;
  if (options.size > 0) work /= "size-" + std::to_string(options.size);
  if (options.log2_table != ReproduceArguments{}.log2_table)
    work /= "table-" + std::to_string(options.log2_table);
  return work;
}

std::vector<baselines::CellName> planned_cells(const ReproduceArguments& options,
                                               const std::vector<baselines::PaperScene>& scenes,
                                               std::uint64_t seed) {
  baselines::PlanOptions plan{.scenes = {}, .seed = seed, .full = options.full};
  for (const auto& scene : scenes) plan.scenes.push_back(scene.name);
  std::vector<std::string> tables = options.tables;
  if (tables.empty())
    for (const auto name : baselines::paper_table_names()) tables.emplace_back(name);
  // Runs every row once before other lengths and scenes, so that a run that ends early shows them all.
  std::stable_partition(tables.begin(), tables.end(), [](const std::string& name) { return name != "bits"; });
  std::vector<baselines::CellName> cells;
  for (const std::string& table : tables)
    for (const auto& name : plan_cells(baselines::parse_paper_table(table), plan))
      if (std::find(cells.begin(), cells.end(), name) == cells.end()) cells.push_back(name);
  if (!options.systems.empty())
    std::erase_if(cells, [&](const baselines::CellName& name) {
      return std::find(options.systems.begin(), options.systems.end(), name.system) == options.systems.end();
    });
  std::stable_partition(cells.begin(), cells.end(),
                        [&](const baselines::CellName& name) { return name.scene == scenes.front().name; });
  return cells;
}

std::vector<baselines::CellName> missing_of(const std::vector<baselines::CellName>& cells,
                                            const std::filesystem::path& folder) {
  std::vector<baselines::CellName> missing;
  for (const auto& name : cells)
    if (!std::filesystem::exists(cell_path(folder, name).string() + ".json")) missing.push_back(name);
  return missing;
}

// Estimates the seconds per cell: the mean of cells measured with this budget, or else 1.5 budgets.
double seconds_of_a_cell(const std::vector<baselines::Cell>& cells, double budget) {
  double sum = 0, count = 0;
  for (const auto& c : cells)
    if (c.more.contains("total_seconds") && c.more.contains("budget") && c.more.at("budget") == budget)
      sum += c.more.at("total_seconds"), count += 1;
  return count > 0 ? sum / count : 1.5 * budget;
}

// A cell that is there counts as measured, whatever its budget.
void note_other_budgets(const std::vector<baselines::CellName>& wanted,
                        const std::vector<baselines::Cell>& found, double budget, Context& context) {
  const auto other = std::ranges::count_if(found, [&](const baselines::Cell& c) {
    return c.more.contains("budget") && c.more.at("budget") != budget &&
           std::ranges::count(wanted, c.name) > 0;
  });
  if (other > 0)
    context.note("cells of other budgets are kept, " + std::to_string(other) + "; for cells of " +
                 results::shown(budget) + " s name another folder with --cells");
}

// The folder of the page's cells, and the subfolder of it, with a slash, in which this run's cells are.
struct CellsFolder {
  std::filesystem::path path;
  std::string below;
};
CellsFolder cells_folder(const ReproduceArguments& options) {
  std::filesystem::path folder = std::filesystem::absolute(options.cells).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();  // "cells/"
  if (folder.filename() != results::kLongerCells) return {folder, ""};
  return {folder.parent_path(), std::string(results::kLongerCells) + "/"};
}

// The page is next to the folder of cells, unless --report names it.
std::filesystem::path page_of(const ReproduceArguments& options, const Context& context) {
  if (!context.options().report.empty()) return context.options().report;
  const auto folder = cells_folder(options).path.parent_path();
  return (folder.lexically_proximate(std::filesystem::current_path()) / "paper.md").lexically_normal();
}

// Saves a cell as a row, with its image next to it.
void save(const ReproduceArguments& options, const std::vector<baselines::PaperScene>& scenes,
          const baselines::MeasuredCell& measured, double seconds) {
  const baselines::CellName& name = measured.cell.name;
  const auto scene =
      std::find_if(scenes.begin(), scenes.end(), [&](const auto& s) { return s.name == name.scene; });
  const std::string data = "scene:" + name.scene;
  const auto file = baselines::cell_path(options.cells, name);
  std::filesystem::create_directories(options.cells);
  write_png(file.string() + ".png", measured.image);
  const results::PlannedRow row{"paper/" + cells_folder(options).below + name.stem(), "reproduce",
                                "reproduce --scene " + data + " --system " + name.system + " --budget " +
                                    results::shown(options.budget)};
  Json json = results::make_row({.id = row.id,
                                 .kind = row.kind,
                                 .command = row.command,
                                 .result = Json::parse(baselines::format_cell(measured.cell)),
                                 .inputs = {{data, results::hash_of(scene->folder)}},
                                 .code = results::Plan::project().code(row),
                                 .seed = name.seed,
                                 .budget = options.budget,
                                 .seconds = seconds});
  write_file_atomically(file.string() + ".json", json.dump(1) + "\n");
}

class Shown {
 public:
  explicit Shown(Context& context) : context_(context) {}
  bool operator()(const std::string& what, double part, const std::string& note) {
    if (what != what_) {
      progress_.reset();
      progress_.reset(new Progress(context_.progress(what)));  // not movable
      what_ = what;
    }
    progress_->update(part, note);
    return !guard_.interrupted();
  }
  void end_line() {
    progress_.reset();
    what_.clear();
  }

 private:
  Context& context_;
  InterruptGuard guard_;
  std::string what_;
  std::unique_ptr<Progress> progress_;
};

void measure(const ReproduceArguments& options, const std::vector<baselines::PaperScene>& scenes,
             const std::vector<baselines::CellName>& missing, Context& context) {
  const auto lpips = load_lpips(LpipsNetwork::alex, options.lpips_weights, context);
  Shown shown(context);
  const Index views =
      options.views > 0 ? options.views : std::clamp<Index>(static_cast<Index>(options.budget), 20, 200);
  nerf::RadianceFieldOptions hash;
  hash.field.encoding.log2_table = options.log2_table;
  baselines::CellRunner runner({.scenes = scenes,
                                .budget = options.budget,
                                .base_seconds = options.base_seconds,
                                .hash = hash,
                                .size = options.size,
                                .views = views,
                                .under_views = std::max<Index>(1, views / 5),
                                .ground_truth = options.ground_truth,
                                .work = work_of(options),
                                .under = {std::begin(kUnder), std::end(kUnder)},
                                .lpips = lpips ? &*lpips : nullptr,
                                .commit = results::machine().commit,
                                .progress = std::ref(shown)});
  for (const auto& name : missing) {
    const double begun = context.seconds();
    try {
      auto measured = runner.run(name);
      shown.end_line();
      measured.cell.more["total_seconds"] = context.seconds() - begun;
      save(options, scenes, measured, context.seconds() - begun);
      results::write_paper_page(cells_folder(options).path, page_of(options, context));
      char line[120];
      std::snprintf(line, sizeof line, ": %.2f%% right, %.2f dB on the foreground, %s\n",
                    100 * measured.cell.bit_accuracy, measured.cell.psnr_base_foreground,
                    format_duration(context.seconds() - begun).c_str());
      context.text() << name.stem() << line;
    } catch (const baselines::Stopped& e) {
      throw Interrupted(std::string(e.what()) + "; the same command resumes");
    }
  }
}

int run_reproduce(const ReproduceArguments& options, Context& context) {
  for (const auto& table : options.tables)
    read_option("--table", [&] { return baselines::parse_paper_table(table); });
  for (const auto& system : options.systems)
    read_option("--system", [&] { return baselines::paper_system(system).name; });
  const auto scenes = scenes_of(options);
  const auto cells = planned_cells(options, scenes, context.seed());
  if (cells.empty()) throw UsageError("--system: no selected table has this system");
  std::filesystem::create_directories(options.cells);
  const auto page = page_of(options, context);
  check_writable_page(page.string());
  auto missing = missing_of(cells, options.cells);
  const auto found = baselines::load_cells(options.cells);
  const double each = seconds_of_a_cell(found, options.budget);
  context.text() << missing.size() << " of " << cells.size() << " cells are missing";
  if (!missing.empty())
    context.text() << ", about " << format_duration(each * static_cast<double>(missing.size()));
  context.text() << "\n";
  for (const auto& name : missing) context.text() << "  " << name.stem() << "\n";
  if (!options.report_only) {
    note_other_budgets(cells, found, options.budget, context);
    measure(options, scenes, missing, context);
    missing = missing_of(cells, options.cells);
  }
  Json left = Json::array();
  for (const auto& name : missing) left.push_back(name.stem());
  context.result({{"cells", cells.size()},
                  {"missing", left},
                  {"seconds_left", each * static_cast<double>(missing.size())}});
  // Replaces the page that every command can write.
  const bool written = results::write_paper_page(cells_folder(options).path, page);
  context.text() << page.string() << (written ? ": written\n" : ": not written, there are no cells\n");
  return kOk;
}

void add_measuring_options(CommandLine& app, ReproduceArguments& o) {
  app.add_option(
         "--budget", o.budget,
         "Training time of each cell in seconds, 0.1 to 86400; cells of other budgets need a folder of their "
         "own, see --cells")
      ->range(0.1, 86400.0)
      ->type_name("S");
  app.add_option(
         "--base-seconds", o.base_seconds,
         "Training time of an unmarked field in seconds, 0.1 to 86400; default: the budget, at most 60 for "
         "hash fields")
      ->range(0.1, 86400.0)
      ->type_name("S")
      ->default_str("");
  app.add_option("--size", o.size,
                 "Longer side of the images in pixels, 16 to 8192; default: 160 as in the released code, 252 "
                 "for scenes "
                 "with a background, 100 for mlp fields")
      ->range(16, 8192)
      ->type_name("N")
      ->default_str("");
  app.add_option("--log2-table", o.log2_table,
                 "Base-2 logarithm of the rows of a hash field's table, 9 to 24")
      ->range(9, 24)
      ->type_name("N");
  app.add_option(
         "--views", o.views,
         "Novel views to read in each cell, 1 to 100000, a fifth of them under distortion; default: one per "
         "second of --budget, 20 to 200; reading ends after --budget seconds")
      ->range(1, 100000)
      ->type_name("N")
      ->default_str("");
  app.add_option("--truth-images", o.ground_truth, "Test images to compare renders with, 1 to 100000")
      ->range(1, 100000)
      ->type_name("N");
}

}  // namespace

Command add_reproduce(CommandLine& app) {
  auto o = std::make_shared<ReproduceArguments>();
  app.add_option(
         "--table", o->tables,
         "Table to measure: bits, quality, distortion, ablation, sampling, weights; repeatable; default: all")
      ->type_name("NAME")
      ->default_str("");
  app.add_option("--scene", o->scenes,
                 "Data set, or objects for the built-in scene; repeatable, the first gets every system;\n"
                 "default: lego, chair and fern of $FIELDMARK_DATA, or objects")
      ->type_name("DIR")
      ->default_str("");
  app.add_option(
         "--system", o->systems,
         "System to measure, named as in its cells, such as copyrnerf_paper; repeatable; default: all;\n"
         "a wrong name lists them")
      ->type_name("NAME")
      ->default_str("");
  add_measuring_options(app, *o);
  app.add_option(
         "--cells", o->cells,
         "Folder of the cells; existing cells are not measured again. paper.md and its figures go to the "
         "folder above it, or beside --report. DIR/longer takes cells of a longer budget for the same page")
      ->type_name("DIR");
  app.add_option("--work", o->work, "Folder for checkpoints and unmarked fields")->type_name("DIR");
  add_lpips_weights(app, o->lpips_weights);
  app.add_flag("--full", o->full, "Measure every length and system on every scene, with three seeds");
  app.add_flag("--report-only", o->report_only,
               "Measure nothing: list what is missing and write the page (--report, or paper.md beside the "
               "folder of cells) and its figures");
  return [o](Context& context) { return run_reproduce(*o, context); };
}

}  // namespace fieldmark::cli
