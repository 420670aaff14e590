#pragma once
#include <sys/types.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::bench {

/// Another program that answers on its standard output by lines, the first unasked and each further one to a
/// line on its standard input. It does not outlive this object.
class LineProcess {
 public:
  /// @param command      the program, searched in PATH if it has no slash, and its arguments; not empty
  /// @param environment  NAME=VALUE entries, in place of or besides those of this process
  /// @param limit_seconds  of each answer, > 0
  /// @throws ValueError if an argument is out of range   @throws IoError if the program cannot be started
  LineProcess(const std::vector<std::string>& command, const std::vector<std::string>& environment,
              double limit_seconds);
  LineProcess(const LineProcess&) = delete;
  LineProcess& operator=(const LineProcess&) = delete;
  /// Kills the program if it still runs.
  ~LineProcess();

  /// The next line it writes, without its end.
  /// @throws IoError if the time is up, or the program has ended: the text has its exit code and the last
  /// lines of its standard error
  std::string read_line();
  /// Sends a line. A program that has ended is noticed by the next read_line().
  void write_line(std::string_view line);

 private:
  [[noreturn]] void fail_ended(double until);
  std::string last_words() const;
  void kill_and_wait();
  std::string program_, received_;
  double limit_seconds_;
  std::FILE* errors_ = nullptr;  ///< its standard error, a file without a name
  int socket_ = -1;
  pid_t pid_ = -1;
};

}  // namespace fieldmark::bench
