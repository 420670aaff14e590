#pragma once
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/outputs.h"
#include "cli/progress.h"

namespace fieldmark::cli {

using Json = nlohmann::ordered_json;

/// Returns null for infinity and NaN, which JSON lacks: the PSNR of equal images, or of an empty foreground.
inline Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// Options shared by all commands.
struct CommonOptions {
  std::uint64_t seed = 1;  ///< seeds every random choice, except keys
  int threads = 0;         ///< 0: all cores
  std::string json{};      ///< file to write, "-": standard output, empty: none
  std::string report{};    ///< Markdown file to write, empty: none
};
void add_common(CommandLine& app, CommonOptions& options);

/// The environment of a command: common options, output streams, progress and results.
class Context {
 public:
  /// Checks that the result files are writable, so that a wrong name does not cost hours of work.
  /// @throws IoError if they cannot
  Context(const CommonOptions& options, std::vector<std::string> command_line, std::ostream& out,
          std::ostream& err);

  const CommonOptions& options() const { return options_; }
  std::uint64_t seed() const { return options_.seed; }
  /// Returns the stream of text for people: standard output, or standard error if --json uses the former.
  std::ostream& text() { return text_; }
  /// Prints a remark on the input and adds it to "notes" of the results; repeated texts appear once.
  void note(const std::string& text);
  /// Reports an input that cannot be read although others can: adds a note and an entry of "left_out" to the
  /// results, and makes the exit code 1 instead of the command's own.
  void leave_out(const std::string& input, const std::string& reason);
  /// True if any input was left out.
  bool left_out() const { return !left_out_.empty(); }
  Progress progress(std::string what) { return Progress(err_, std::move(what)); }
  /// Returns the seconds since the command was called.
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
  Json left_out_ = Json::array();
};

}  // namespace fieldmark::cli
