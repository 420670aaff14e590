#pragma once
#include <chrono>
#include <iosfwd>
#include <string>
#include <string_view>

namespace fieldmark::cli {

/// Formats a duration: "7 s", "3 min 05 s", "2 h 07 min".
std::string format_duration(double seconds);

/// Reports progress: on a terminal one updated line, elsewhere one line per tenth.
class Progress {
 public:
  /// A terminal is std::cerr or std::cout connected to one. `out` must outlive this.
  Progress(std::ostream& out, std::string what);
  Progress(std::ostream& out, std::string what, bool terminal);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  /// Ends the line on a terminal.
  ~Progress();
  /// @param fraction  of the work done, in [0, 1]   @param note  shown after it, such as a loss
  void update(double fraction, std::string_view note = {});
  double seconds() const;

 private:
  using Clock = std::chrono::steady_clock;
  void show(double fraction, std::string_view note);
  std::string time_left(double fraction, double elapsed) const;
  std::ostream& out_;
  std::string what_;
  bool terminal_;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point shown_ = begin_;
  double first_ = -1;  ///< fraction of the first report; negative before it
  double first_seconds_ = 0;
  int tenth_ = 0;            ///< the last one reported
  std::size_t on_line_ = 0;  ///< characters on the terminal's current line
};

/// While a guard is alive, the first Ctrl-C sets a flag for the work to poll, and the second kills the
/// process. Guards nest: an inner guard sees the flag of an outer one.
class InterruptGuard {
 public:
  InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
  ~InterruptGuard();
  bool interrupted() const;
};

}  // namespace fieldmark::cli
