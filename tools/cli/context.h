#pragma once
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/progress.h"

namespace fieldmark::cli {

using Json = nlohmann::ordered_json;

/// JSON knows neither infinity nor NaN: the PSNR of equal images, or of an object that is not there, is
/// null.
inline Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// Options that every command has.
struct CommonOptions {
  std::uint64_t seed = 1;  ///< of every random choice, except keys
  int threads = 0;         ///< 0: all that the machine offers
  std::string json{};      ///< file for the results, "-" for standard output, empty for none
  std::string report{};    ///< Markdown file for the results with their protocol, empty for none
};
void add_common(CommandLine& app, CommonOptions& options);

/// @throws IoError if no file can be made under this name; what is there stays
void check_writable(const std::string& path);

/// What a command gets besides its own options: where to write and how to report.
class Context {
 public:
  /// Checks at once that the files for results can be written, so that hours of work are not lost for a wrong
  /// name.
  /// @throws IoError if they cannot
  Context(const CommonOptions& options, std::vector<std::string> command_line, std::ostream& out,
          std::ostream& err);

  const CommonOptions& options() const { return options_; }
  std::uint64_t seed() const { return options_.seed; }
  /// For people: standard output, or standard error when the results take standard output.
  std::ostream& text() { return text_; }
  /// What people should know of a run's input: printed at once, and in the results under "notes"; each text
  /// once.
  void note(const std::string& text);
  Progress progress(std::string what) { return Progress(err_, std::move(what)); }
  /// Since the command was called.
  double seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }
  /// Writes the results to --json and --report. @throws IoError if a file cannot be written
  void result(const Json& found);

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
  CommonOptions options_;
  std::vector<std::string> command_line_;
  std::ostream &out_, &err_, &text_;
  std::vector<std::string> notes_;
};

}  // namespace fieldmark::cli
