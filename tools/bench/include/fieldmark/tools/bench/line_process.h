#pragma once
#include <sys/types.h>

#include <cstdio>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::bench {

/// Another program that writes lines to its standard output: the first unasked, then one in reply to each
/// line on its standard input. It does not outlive this object.
class LineProcess {
 public:
  /// @param command      the program, searched in PATH if it has no slash, and its arguments; not empty
  /// @param environment  NAME=VALUE entries that extend or override those of this process
  /// @param limit_seconds  per answer, > 0
  /// @throws ValueError if an argument is out of range   @throws IoError if the program cannot be started
  LineProcess(const std::vector<std::string>& command, const std::vector<std::string>& environment,
              double limit_seconds);
  LineProcess(const LineProcess&) = delete;
  LineProcess& operator=(const LineProcess&) = delete;
  /// Kills the program if it still runs.
  ~LineProcess();

  /// Reads the next line that it writes, without the line ending.
  /// @throws IoError if the time is up, or the program has ended: the text includes its exit code and the
  /// last lines of its standard error
  std::string read_line();
  /// Sends a line. If the program has ended, the next read_line() reports it.
  void write_line(std::string_view line);
  /// Waits until the program ends and drops its output. Its standard input ends at once.
  /// @param tick  called ten times a second and at the end; may throw to give up
  /// @throws IoError if the time is up or its exit code is not 0, with the last lines of its standard error
  void finish(const std::function<void()>& tick = {});

 private:
  bool receive(double until, const char* what, const std::function<void()>& tick);
  int status_at_end(double until, const std::function<void()>& tick);
  std::string last_words() const;
  void kill_and_wait();
  std::string program_, received_;
  double limit_seconds_;
  std::FILE* errors_ = nullptr;  ///< its standard error, an unnamed file
  int socket_ = -1;
  pid_t pid_ = -1;
};

}  // namespace fieldmark::bench
