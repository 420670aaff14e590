#pragma once
#include <fieldmark/core/error.h>

#include <iosfwd>
#include <stdexcept>
#include <string>

namespace fieldmark::cli {

enum ExitCode { kOk = 0, kFailed = 1, kUsage = 2, kNotFound = 3, kInterrupted = 130 };

/// Incorrect usage that the option parser cannot detect: exit code 2.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
/// Returns an error's text without the function in brackets that it begins with.
std::string without_function(const std::string& what);
/// Calls f, which parses the value of an option, and turns a ValueError into a UsageError.
template <class F>
auto read_option(const char* option, F&& f) try {
  return f();
} catch (const ValueError& e) {
  throw UsageError(std::string(option) + ": " + without_function(e.what()));
}
/// Thrown after Ctrl-C, once the command has saved its state: exit code 130.
struct Interrupted : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Runs the fieldmark command; main() passes the streams of the process.
/// @return the exit code; never throws
int run(int argc, const char* const* argv, std::ostream& out, std::ostream& err) noexcept;

}  // namespace fieldmark::cli
