#include "cli/context.h"

#include <fieldmark/core/files.h>

#include <algorithm>
#include <ostream>

#include <fieldmark/tools/results/report.h>

namespace fieldmark::cli {

void add_common(CommandLine& app, CommonOptions& options) {
  app.add_option("--seed", options.seed, "Seed of every random choice except keys, 0 to 2^64 - 1")
      ->group("Common")
      ->type_name("N");
  app.add_option("--threads", options.threads, "Threads to use, 1 to 1024; default: all cores")
      ->range(1, 1024)
      ->group("Common")
      ->type_name("N")
      ->default_str("");
  app.add_option("--json", options.json, "File to write, the results as JSON; - for standard output")
      ->group("Common")
      ->type_name("FILE");
  app.add_option("--report", options.report,
                 "File to write, the results with command, commit and machine as Markdown")
      ->group("Common")
      ->type_name("FILE");
}

void check_writable(const std::string& path) { AtomicFile{path}; }

Context::Context(const CommonOptions& options, std::vector<std::string> command_line, std::ostream& out,
                 std::ostream& err)
    : options_(options),
      command_line_(std::move(command_line)),
      out_(out),
      err_(err),
      text_(options.json == "-" ? err : out) {
  for (const auto& path : {options.json, options.report})
    if (!path.empty() && path != "-") check_writable(path);
}

void Context::note(const std::string& text) {
  if (std::find(notes_.begin(), notes_.end(), text) != notes_.end()) return;
  text_ << "note: " << text << "\n";
  notes_.push_back(text);
}

void Context::result(const Json& found) {
  Json json = found;
  if (!notes_.empty()) json["notes"] = notes_;
  if (options_.json == "-") {
    out_ << json.dump(2) << "\n";
  } else if (!options_.json.empty()) {
    write_file_atomically(options_.json, json.dump(2) + "\n");
  }
  if (!options_.report.empty())
    write_file_atomically(options_.report, results::markdown_report(command_line_, results::machine(), json));
}

}  // namespace fieldmark::cli
