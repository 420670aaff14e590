#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/tools/results/page.h>
#include <fieldmark/tools/results/paper_page.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>
#include <optional>
#include <ostream>
#include <sstream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/shared_data.h"

namespace fieldmark::cli {
namespace {

namespace fs = std::filesystem;
using results::Plan;
using results::PlannedRow;

constexpr const char *kPages = "docs/results", *kRows = "docs/results/rows";

struct ResultsArguments {
  std::string rows, work = "results_work";
  std::string out;  // empty: kPages
  std::vector<std::string> run;
  std::optional<double> budget;  // seconds; without limit by default
  bool stale = false, render = false, draft = false;
};

// Returns a row of the plan, or of a command such as `reproduce` that is not planned row by row.
PlannedRow planned(const Plan& plan, const std::string& id, const Json& row) {
  if (const PlannedRow* found = plan.find(id)) return *found;
  return {id, row.at("kind"), row.at("command")};
}

class Runner {
 public:
  Runner(const ResultsArguments& options, Context& context)
      : options_(options),
        context_(context),
        rows_(results::load_rows(options.rows)),
        places_{.data = shared_data(""), .work = fs::absolute(options.work)} {}

  const results::Rows& rows() const { return rows_; }
  std::string stale(const std::string& id) const {
    const auto row = rows_.find(id);
    return results::stale_reason(plan_, planned(plan_, id, row == rows_.end() ? Json::object() : row->second),
                                 rows_, places_);
  }
  const Json& counts() const { return counts_; }

  /// Measures a row after the rows that create its inputs. @return true if it is fresh now
  bool ensure(const PlannedRow& row) {
    if (const auto known = tried_.find(row.id); known != tried_.end()) return known->second;
    bool& ok = tried_[row.id] = false;
    for (const std::string& word : row.inputs())
      if (word.starts_with('@') ? !ensure_file(*plan_.producer(word)) : !has_scene(row, word)) return false;
    if (stale(row.id).empty()) return ok = true;
    return ok = measure(row);
  }

 private:
  // Ensures that the file in the work folder is that of the fresh row.
  bool ensure_file(const PlannedRow& row) {
    if (!ensure(row)) return false;
    const fs::path file = results::path_of(plan_, row.output(), places_);
    return results::hash_of(file) == rows_.at(row.id).at("output") || measure(row);
  }
  bool has_scene(const PlannedRow& row, const std::string& word) {
    const fs::path folder = results::path_of(plan_, word, places_);
    if (!folder.empty() && fs::exists(folder)) return true;
    return count("skipped", row.id + ": skipped, FIELDMARK_DATA has no data set '" + word.substr(6) + "'");
  }
  bool count(const char* what, const std::string& text) {
    counts_[what] = counts_.value(what, 0) + 1;
    context_.text() << text << "\n" << std::flush;
    return false;
  }

  bool measure(const PlannedRow& row) {
    const auto before = rows_.find(row.id);
    const double expected = before == rows_.end() || before->second["seconds"].is_null()
                                ? 0
                                : before->second["seconds"].get<double>();
    if (options_.budget && context_.seconds() + expected > *options_.budget)
      return count("left", row.id + ": left, the budget has no " + format_duration(expected) + " for it");
    results::Measured m{.id = row.id,
                        .kind = row.kind,
                        .command = row.command,
                        .inputs = results::input_hashes(plan_, row, rows_, places_),
                        .code = plan_.code(row)};
    const fs::path log = places_.work / "logs" / (row.id + ".log"),
                   json = places_.work / "logs" / (row.id + ".json");
    fs::create_directories(log.parent_path());
    // Removes the output of a stale row: embed does not replace an owner, and render does not add to views.
    if (!row.output().empty()) {
      const fs::path made = results::path_of(plan_, row.output(), places_);
      fs::remove_all(made);
      keep_checkpoint_of(made, m.command + "\n" + m.code + "\n" + m.inputs.dump());
    }
    const double begun = context_.seconds();
    const int code = call(command_line(row, json.string(), m), log);
    if (code == kInterrupted) throw Interrupted("rows that are done are kept");
    if (code != kOk && code != kNotFound)
      return count("failed",
                   row.id + ": failed with exit code " + std::to_string(code) + ", see " + log.string());
    m.seconds = context_.seconds() - begun;
    m.result = results::with_names(Json::parse(read_text(json)), places_);
    if (!row.output().empty()) m.output = results::hash_of(results::path_of(plan_, row.output(), places_));
    rows_[row.id] = results::make_row(m);
    results::save_row(options_.rows, rows_[row.id]);
    count("measured", row.id + ": measured in " + format_duration(m.seconds));
    return true;
  }

  // Removes the checkpoint of an output unless it was made by the same command, code and inputs: what other
  // code has trained in part must not be resumed under this commit.
  static void keep_checkpoint_of(const fs::path& output, const std::string& made_by) {
    const fs::path checkpoint = output.string() + ".checkpoint", note = output.string() + ".made_by";
    if (!fs::exists(note) || read_text(note) != made_by) fs::remove(checkpoint);
    fs::create_directories(note.parent_path());
    write_file_atomically(note, made_by);
  }

  // Returns the words of a command with names replaced by paths; records seed and budget.
  std::vector<std::string> command_line(const PlannedRow& row, const std::string& json,
                                        results::Measured& m) const {
    std::vector<std::string> line{"fieldmark"};
    std::istringstream words(row.command);
    for (std::string word; words >> word; line.push_back(word)) {
      if (line.back() == "--seed") m.seed = std::stoull(word);
      if (line.back() == "--seconds" || line.back() == "--budget") m.budget = std::stod(word);
      if (!word.starts_with('@') && !word.starts_with("scene:")) continue;
      word = results::path_of(plan_, word, places_).string();
      if (line.back() == "--out") fs::create_directories(fs::path(word).parent_path());
    }
    if (std::ranges::find(line, "--threads") == line.end())
      line.insert(line.end(), {"--threads", std::to_string(threads_)});
    if (const std::string out = row.output(); !out.empty())
      if (fs::exists(results::path_of(plan_, out, places_).string() + ".checkpoint"))
        line.emplace_back("--resume");
    line.insert(line.end(), {"--json", json});
    return line;
  }

  int call(const std::vector<std::string>& line, const fs::path& log) const {
    std::vector<const char*> words;
    for (const auto& word : line) words.push_back(word.c_str());
    std::ofstream out(log);
    const int code = cli::run(static_cast<int>(words.size()), words.data(), out, out);
    set_threads(threads_);
    return code;
  }

  const ResultsArguments& options_;
  Context& context_;
  const Plan& plan_ = Plan::project();
  const int threads_ = threads();
  results::Rows rows_;
  results::Places places_;
  std::map<std::string, bool> tried_;
  Json counts_ = Json::object();
};

std::vector<PlannedRow> selected(const ResultsArguments& options, const Runner& runner) {
  std::vector<PlannedRow> rows;
  std::vector<std::string> unknown = options.run;
  for (const PlannedRow& row : Plan::project().rows()) {
    const auto named = std::ranges::find_if(options.run, [&](const std::string& name) {
      return row.id == name || row.id.starts_with(name + "/");
    });
    if (named != options.run.end()) std::erase(unknown, *named);
    if (named != options.run.end() || (options.stale && !runner.stale(row.id).empty())) rows.push_back(row);
  }
  if (!unknown.empty()) throw UsageError("--run: no row of the plan is called '" + unknown[0] + "'");
  return rows;
}

Json age_in_days(const Json& row) {
  int year = 0;
  unsigned month = 0, day = 0;
  if (std::sscanf(row.at("date").get<std::string>().c_str(), "%d-%u-%u", &year, &month, &day) != 3)
    return nullptr;
  const std::chrono::year_month_day date{std::chrono::year(year), std::chrono::month(month),
                                         std::chrono::day(day)};
  const auto today = std::chrono::floor<std::chrono::days>(std::chrono::system_clock::now());
  return (today - std::chrono::sys_days(date)).count();
}

Json list_rows(const Runner& runner, Context& context) {
  std::vector<std::string> ids;
  for (const PlannedRow& row : Plan::project().rows()) ids.push_back(row.id);
  for (const auto& [id, row] : runner.rows())
    if (!Plan::project().find(id)) ids.push_back(id);
  Json listed = Json::array();
  std::size_t fresh = 0;
  for (const std::string& id : ids) {
    const auto found = runner.rows().find(id);
    const Json row = found == runner.rows().end() ? Json() : found->second;
    const std::string why = runner.stale(id);
    if (why.empty()) ++fresh;
    listed.push_back({{"id", id},
                      {"kind", planned(Plan::project(), id, row).kind},
                      {"state", row.is_null() ? "missing"
                                : why.empty() ? "fresh"
                                              : "stale"},
                      {"reason", why},
                      {"age_days", row.is_null() ? Json() : age_in_days(row)},
                      {"seconds", row.is_null() ? Json() : row["seconds"]}});
    char line[200];
    const Json& l = listed.back();
    std::snprintf(line, sizeof line, "%-32s %-15s %-8s %5s d %8s s  %s\n", id.c_str(),
                  l["kind"].get<std::string>().c_str(), l["state"].get<std::string>().c_str(),
                  results::shown(l["age_days"]).c_str(), results::shown(l["seconds"]).c_str(), why.c_str());
    context.text() << line;
  }
  context.text() << ids.size() << " rows, " << fresh << " fresh\n";
  return listed;
}

void render(const ResultsArguments& options, const Runner& runner, Context& context) {
  const std::string out = options.out.empty() ? kPages : options.out;
  const auto stale = [&](const std::string& id) { return runner.stale(id); };
  const auto pages = results::render_pages(results::project_pages(), runner.rows(), stale);
  for (const auto& [name, text] : pages) write_file_atomically(fs::path(out) / name, text);
  results::write_paper_page(fs::path(options.rows) / "paper", fs::path(out) / "paper.md", stale);
  context.text() << out << ": " << pages.size() + 1 << " pages and charts written\n";
}

int run_results(ResultsArguments options, Context& context) {
  const bool runs = options.stale || !options.run.empty();
  if (!options.render && !options.out.empty()) throw UsageError("--out: needs --render");
  if (!runs && options.budget) throw UsageError("--budget: needs --run or --stale");
  if (options.draft && !options.rows.empty())
    throw UsageError("--draft: excludes --rows, its rows go to WORK/rows");
  if (options.rows.empty()) options.rows = kRows;
  if (options.draft) options.rows = (fs::path(options.work) / "rows").string();
  const std::string commit = results::machine().commit;
  if (runs && !options.draft && (commit == "unknown" || commit.ends_with("changes")))
    throw UsageError(std::string(options.stale ? "--stale" : "--run") +
                     ": expected sources with a clean commit, found " + commit +
                     "; commit the changes and build again, or use --draft");
  if (options.render) fs::create_directories(options.out.empty() ? kPages : options.out);
  Runner runner(options, context);
  for (const PlannedRow& row : runs ? selected(options, runner) : std::vector<PlannedRow>())
    runner.ensure(row);
  if (options.render) render(options, runner, context);
  Json json = runner.counts();
  if (!runs && !options.render) json["rows"] = list_rows(runner, context);
  context.result(json);
  return json.contains("failed") ? kFailed : kOk;
}

}  // namespace

Command add_results(CommandLine& app) {
  auto o = std::make_shared<ResultsArguments>();
  app.add_option("--rows", o->rows, "Folder of the rows, one JSON file each")
      ->type_name("DIR")
      ->default_str(kRows);
  app.add_option("--out", o->out, "Folder of the pages, for --render")->type_name("DIR")->default_str(kPages);
  app.add_option("--work", o->work, "Folder of fields, owners and logs that runs make")->type_name("DIR");
  auto named = app.add_option("--run", o->run,
                              "Rows to measure, with those they need; a folder stands for all rows in it. "
                              "Fresh rows are skipped")
                   ->delimiter(',')
                   ->type_name("ID[,ID...]")
                   ->default_str("");
  app.add_flag("--stale", o->stale, "Measure every row that is stale or missing")->excludes(named);
  app.add_option("--budget", o->budget,
                 "Time limit in seconds, 1 to 10000000; rows expected to exceed it are not started; default: "
                 "no limit")
      ->range(1.0, 1e7)
      ->type_name("S")
      ->default_str("");
  app.add_flag("--draft", o->draft, "Write rows to WORK/rows instead of --rows; allows uncommitted changes");
  app.add_flag("--render", o->render, "Write all pages to --out, from the rows alone");
  return [o](Context& context) { return run_results(*o, context); };
}

}  // namespace fieldmark::cli
