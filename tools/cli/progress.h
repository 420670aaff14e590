#pragma once
#include <chrono>
#include <iosfwd>
#include <string>
#include <string_view>

namespace fieldmark::cli {

/// "7 s", "3 min 05 s", "2 h 07 min".
std::string format_duration(double seconds);

/// Shows how far a long piece of work is: one line that is rewritten on a terminal, elsewhere a line for
/// every tenth.
class Progress {
 public:
  /// A terminal is recognised by `out` being std::cerr or std::cout connected to one. `out` must outlive
  /// this.
  Progress(std::ostream& out, std::string what);
  Progress(std::ostream& out, std::string what, bool terminal);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Ends a line that was begun on a terminal.
  ~Progress();
  /// @param fraction of the work that is done, in [0, 1]   @param note  shown behind it, such as a loss
  void update(double fraction, std::string_view note = {});
  double seconds() const;

 private:
  using Clock = std::chrono::steady_clock;
  void show(double fraction, std::string_view note);
  std::ostream& out_;
  std::string what_;
  bool terminal_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point shown_ = begin_;
  int tenth_ = 0;            ///< last one told of
  std::size_t on_line_ = 0;  ///< characters of the line that stands on the terminal
};

/// While one is alive, the first Ctrl-C only sets a flag, which work in progress is to ask for; the second
/// one kills. Guards nest: an inner one sees what an outer one was told.
class InterruptGuard {
 public:
  InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  ~InterruptGuard();
  bool interrupted() const;
};

}  // namespace fieldmark::cli
