#include <fieldmark/distort/gradcheck_cases.h>
#include <fieldmark/engine/gradcheck_cases.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/extractor/gradcheck_cases.h>
#include <fieldmark/nerf/gradcheck_cases.h>
#include <fieldmark/watermark/gradcheck_cases.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

struct Options {
  std::string only;
};

struct Row {
  std::string module;
  GradcheckCase check;
  GradcheckReport report;
};

std::vector<Row> collect(const std::string& only) {
  std::vector<Row> rows;
  const auto add = [&](const char* module, std::vector<GradcheckCase> cases) {
    for (auto& check : cases)
      if (check.name.find(only) != std::string::npos) rows.push_back({module, std::move(check), {}});
  };
  add("engine", gradcheck_cases());
  add("distort", distort::gradcheck_cases());
  add("extractor", extractor::gradcheck_cases());
  add("nerf", nerf::gradcheck_cases());
  add("watermark", watermark::gradcheck_cases());
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

int run(const Options& options, Context& context) {
  std::vector<Row> rows = collect(options.only);
  if (rows.empty()) throw UsageError("--only: no check has '" + options.only + "' in its name");
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

}  // namespace

Command add_gradcheck(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option("--only", options->only, "Only checks with TEXT in their name")
      ->type_name("TEXT")
      ->default_str("all");
  return [options](Context& context) { return run(*options, context); };
}

}  // namespace fieldmark::cli
