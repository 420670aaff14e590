#pragma once
#include <fieldmark/core/error.h>

#include <iosfwd>
#include <stdexcept>
#include <string>

namespace fieldmark::cli {

enum ExitCode { kOk = 0, kFailed = 1, kUsage = 2, kNotFound = 3, kInterrupted = 130 };

/// What the user asked for cannot be meant: exit code 2. For what the parser of options cannot see by itself.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Calls f, which reads the value of an option: what the library says of the value is then the user's error.
template <class F>
auto read_option(const char* option, F&& f) try {
  return f();
} catch (const ValueError& e) {
  throw UsageError(std::string(option) + ": " + e.what());
}
/// A command stopped because the user pressed Ctrl-C, after it has saved what there was to save: exit code
/// 130.
struct Interrupted : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The whole of the fieldmark command; main() only passes the streams of the process.
/// @return the exit code; nothing is thrown
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err) noexcept;

}  // namespace fieldmark::cli
