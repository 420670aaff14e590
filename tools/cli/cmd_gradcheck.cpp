#include <fieldmark/baselines/gradcheck_cases.h>
#include <fieldmark/core/worst.h>
#include <fieldmark/distort/gradcheck_cases.h>
#include <fieldmark/distort/numerics_cases.h>
#include <fieldmark/engine/gradcheck_cases.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/numerics_cases.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/extractor/gradcheck_cases.h>
#include <fieldmark/extractor/numerics_cases.h>
#include <fieldmark/imaging/gradcheck_cases.h>
#include <fieldmark/imaging/numerics_cases.h>
#include <fieldmark/nerf/gradcheck_cases.h>
#include <fieldmark/nerf/numerics_cases.h>
#include <fieldmark/watermark/evidence/numerics_cases.h>
#include <fieldmark/watermark/mark/gradcheck_cases.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

struct GradcheckArguments {
  std::string only;
  bool numerics = false;
};

struct Row {
  std::string module;
  GradcheckCase check;
  GradcheckReport report;
};

// Returns the cases of all modules whose name contains the text. @throws UsageError if there are none
template <class R, class Case>
std::vector<R> collect(const GradcheckArguments& options,
                       std::initializer_list<std::pair<const char*, std::vector<Case>>> modules) {
  std::vector<R> rows;
  for (const auto& [module, cases] : modules)
    for (const Case& check : cases)
      if (check.name.find(options.only) != std::string::npos) rows.push_back({module, check, {}});
  if (rows.empty()) throw UsageError("--only: no check has '" + options.only + "' in its name");
  return rows;
}

void run_case(Row& row) {
  try {
    row.report = row.check.run();
  } catch (const std::exception& e) {
    row.report.ok = false;
    row.report.worst = std::nan("");
    row.report.table = std::string(e.what()) + "\n";
  }
}

Json to_json(const std::vector<Row>& rows, const Row& worst, Index entries, bool ok) {
  Json json{
      {"ok", ok}, {"worst", worst.report.worst}, {"worst_case", worst.check.name}, {"entries", entries}};
  json["cases"] = Json::array();
  for (const auto& row : rows)
    json["cases"].push_back({{"module", row.module},
                             {"name", row.check.name},
                             {"entries", row.report.entries},
                             {"worst", row.report.worst},
                             {"ok", row.report.ok}});
  return json;
}

int run_gradients(const GradcheckArguments& options, Context& context) {
  auto rows = collect<Row, GradcheckCase>(options, {{"engine", gradcheck_cases()},
                                                    {"imaging", imaging::gradcheck_cases()},
                                                    {"distort", distort::gradcheck_cases()},
                                                    {"extractor", extractor::gradcheck_cases()},
                                                    {"nerf", nerf::gradcheck_cases()},
                                                    {"watermark", watermark::gradcheck_cases()},
                                                    {"baselines", baselines::gradcheck_cases()}});
  parallel_for(static_cast<Index>(rows.size()), 1, [&](Index begin, Index end) {
    for (Index i = begin; i < end; ++i) run_case(rows[static_cast<std::size_t>(i)]);
  });

  bool ok = true;
  Index entries = 0;
  const Row* worst = &rows.front();
  for (const auto& row : rows) {
    char line[160];
    std::snprintf(line, sizeof line, "%-10s %-44s %7lld entries  worst %.2e  %s\n", row.module.c_str(),
                  row.check.name.c_str(), static_cast<long long>(row.report.entries), row.report.worst,
                  row.report.ok ? "ok" : "FAILED");
    context.text() << line << row.report.table;
    ok = ok && row.report.ok;
    entries += row.report.entries;
    if (!(row.report.worst <= worst->report.worst)) worst = &row;
  }
  char summary[200];
  std::snprintf(summary, sizeof summary, "%zu checks, %lld entries, worst relative error %.2e (%s): %s\n",
                rows.size(), static_cast<long long>(entries), worst->report.worst, worst->check.name.c_str(),
                ok ? "ok" : "FAILED");
  context.text() << summary;
  context.result(to_json(rows, *worst, entries, ok));
  return ok ? kOk : kFailed;
}

struct NumericsRow {
  std::string module;
  NumericsCase check;
  std::vector<WorstError> errors;  // one per instruction set

  bool ok() const {
    return std::all_of(errors.begin(), errors.end(), [&](const WorstError& e) { return check.ok(e); });
  }
  double worst() const {
    double worst = 0;
    for (const auto& e : errors) raise_to(worst, e.worst);
    return worst;
  }
};

// Runs every case on every instruction set of this CPU; returns their names.
std::vector<std::string> run_on_each_isa(std::vector<NumericsRow>& rows) {
  std::vector<std::string> levels;
  for (const Isa level : {Isa::v2, Isa::v3, Isa::v4}) {
    if (level > isa_supported()) break;
    const ScopedIsa scope(level);
    levels.emplace_back(isa_name());
    parallel_for(static_cast<Index>(rows.size()), 1, [&](Index i, Index) {
      NumericsRow& row = rows[static_cast<std::size_t>(i)];
      row.errors.push_back(row.check.run());
    });
  }
  return levels;
}

Json numerics_json(const std::vector<NumericsRow>& rows, const std::vector<std::string>& levels, bool ok) {
  Json json{{"ok", ok}, {"cases", Json::array()}};
  for (const auto& row : rows) {
    Json entry{{"module", row.module},
               {"name", row.check.name},
               {"type", row.check.type},
               {"relative_to", row.check.relative_to}};
    for (std::size_t k = 0; k < levels.size(); ++k) entry[levels[k]] = number(row.errors[k].worst);
    entry["limit"] = row.check.limit;
    entry["numbers"] = row.errors[0].values;
    entry["ok"] = row.ok();
    json["cases"].push_back(std::move(entry));
  }
  return json;
}

int run_numerics(const GradcheckArguments& options, Context& context) {
  auto rows = collect<NumericsRow, NumericsCase>(options, {{"engine", numerics_cases()},
                                                           {"imaging", imaging::numerics_cases()},
                                                           {"distort", distort::numerics_cases()},
                                                           {"extractor", extractor::numerics_cases()},
                                                           {"nerf", nerf::numerics_cases()},
                                                           {"watermark", watermark::numerics_cases()}});
  const auto levels = run_on_each_isa(rows);
  bool ok = true;
  for (const auto& row : rows) {
    char line[240];
    std::snprintf(line, sizeof line, "%-10s %-62s %-6s worst %.1e, limit %.1e of %s  %s\n",
                  row.module.c_str(), row.check.name.c_str(), row.check.type.c_str(), row.worst(),
                  row.check.limit, row.check.relative_to.c_str(), row.ok() ? "ok" : "FAILED");
    context.text() << line;
    ok = ok && row.ok();
  }
  context.text() << rows.size() << " hard cases on " << levels.size() << " instruction sets (";
  for (std::size_t k = 0; k < levels.size(); ++k) context.text() << (k > 0 ? ", " : "") << levels[k];
  context.text() << "), against long double: " << (ok ? "ok" : "FAILED") << "\n";
  context.result(numerics_json(rows, levels, ok));
  return ok ? kOk : kFailed;
}

}  // namespace

Command add_gradcheck(CommandLine& app) {
  auto options = std::make_shared<GradcheckArguments>();
  app.add_option("--only", options->only, "Checks whose names contain TEXT; default: all")
      ->type_name("TEXT")
      ->default_str("");
  app.add_flag(
      "--numerics", options->numerics,
      "Check hard numerical cases against long double on every instruction set, instead of gradients");
  return [options](Context& context) {
    return options->numerics ? run_numerics(*options, context) : run_gradients(*options, context);
  };
}

}  // namespace fieldmark::cli
