#include "cli/context.h"

#include <fieldmark/core/files.h>

#include <algorithm>
#include <ostream>

#include <fieldmark/tools/results/report.h>
#include "cli/cli.h"
#include "cli/outputs.h"

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
  app.add_option("--json", options.json,
                 "JSON file to write the results to; - for standard output; default: none")
      ->group("Common")
      ->type_name("FILE");
  app.add_option("--report", options.report,
                 "Markdown file to write the results to, with command, commit and machine; default: none")
      ->group("Common")
      ->type_name("FILE");
}

Context::Context(const CommonOptions& options, std::vector<std::string> command_line, std::ostream& out,
                 std::ostream& err)
    : options_(options),
      command_line_(std::move(command_line)),
      out_(out),
      err_(err),
      text_(options.json == "-" ? err : out) {
  for (const auto& path : {options.json, options.report})
    if (!path.empty() && path != "-") check_writable_page(path);
  if (same_file(options.json, options.report))
    throw UsageError("--report: " + options.report + " is the file of --json");
}

void Context::note(const std::string& text) {
  if (std::find(notes_.begin(), notes_.end(), text) != notes_.end()) return;
  text_ << "note: " << text << "\n";
  notes_.push_back(text);
}

void Context::leave_out(const std::string& input, const std::string& reason) {
  note("left out, " + reason);
  left_out_.push_back({{"image", input}, {"reason", reason}});
}

void Context::result(const Json& found) {
  Json json = found;
  if (!notes_.empty()) json["notes"] = notes_;
  if (left_out()) json["left_out"] = left_out_;
  // Bytes that are not UTF-8 become U+FFFD.
  const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  if (options_.json == "-") {
    out_ << text;
  } else if (!options_.json.empty()) {
    check_writable_page(options_.json);  // the command may have created a field with this name
    write_file_atomically(options_.json, text);
  }
  if (!options_.report.empty()) {
    check_writable_page(options_.report);
    write_file_atomically(options_.report, results::markdown_report(command_line_, results::machine(), json));
  }
}

}  // namespace fieldmark::cli
