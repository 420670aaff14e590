#include "cli/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <iostream>

namespace fieldmark::cli {
namespace {

volatile std::sig_atomic_t interrupt_flag = 0;
int guards = 0;

void on_interrupt(int) {
  interrupt_flag = 1;
  std::signal(SIGINT, SIG_DFL);
}

bool is_terminal(const std::ostream& out) {
  if (&out == &std::cerr) return ::isatty(STDERR_FILENO) == 1;
  return &out == &std::cout && ::isatty(STDOUT_FILENO) == 1;
}

}  // namespace

std::string format_duration(double seconds) {
  const long long s = std::llround(std::clamp(seconds, 0.0, 1e9));
  char text[64];
  if (s < 60)
    std::snprintf(text, sizeof text, "%lld s", s);
  else if (s < 3600)
    std::snprintf(text, sizeof text, "%lld min %02lld s", s / 60, s % 60);
  else
    std::snprintf(text, sizeof text, "%lld h %02lld min", s / 3600, s / 60 % 60);
  return text;
}

Progress::Progress(std::ostream& out, std::string what) : Progress(out, std::move(what), is_terminal(out)) {}

Progress::Progress(std::ostream& out, std::string what, bool terminal)
    : out_(out), what_(std::move(what)), terminal_(terminal) {}

Progress::~Progress() {
  if (on_line_ > 0) out_ << "\n" << std::flush;
}

double Progress::seconds() const { return std::chrono::duration<double>(Clock::now() - begin_).count(); }

void Progress::update(double fraction, std::string_view note) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (first_ < 0) {
    first_ = fraction;
    first_seconds_ = seconds();
  }
  if (terminal_) {
    const bool due = fraction == 1 || on_line_ == 0 || Clock::now() - shown_ > std::chrono::milliseconds(100);
    if (due) show(fraction, note);
    return;
  }
  const int tenth = static_cast<int>(fraction * 10 + 1e-9);
  if (tenth <= tenth_) return;
  tenth_ = tenth;
  show(fraction, note);
}

// The rate is that of the work since the first report, because a resumed run starts far from 0. Empty at the
// first report.
std::string Progress::time_left(double fraction, double elapsed) const {
  if (fraction <= first_) return "";
  return format_duration((elapsed - first_seconds_) * (1 - fraction) / (fraction - first_)) + " left";
}

void Progress::show(double fraction, std::string_view note) {
  shown_ = Clock::now();
  const double elapsed = seconds();
  std::string line = what_ + " " + std::to_string(static_cast<int>(fraction * 100 + 1e-9)) + "%  ";
  if (fraction >= 1)
    line += "in " + format_duration(elapsed);
  else if (fraction > 0)
    line += time_left(fraction, elapsed);
  if (!note.empty()) line += "  " + std::string(note);
  if (terminal_) {
    const std::size_t blanks = on_line_ > line.size() ? on_line_ - line.size() : 0;
    on_line_ = line.size();
    out_ << "\r" << line << std::string(blanks, ' ') << std::flush;
  } else {
    out_ << line << "\n" << std::flush;
  }
}

InterruptGuard::InterruptGuard() {
  if (guards++ > 0) return;
  interrupt_flag = 0;
  std::signal(SIGINT, on_interrupt);
}

InterruptGuard::~InterruptGuard() {
  if (--guards == 0) std::signal(SIGINT, SIG_DFL);
}

bool InterruptGuard::interrupted() const { return interrupt_flag != 0; }

}  // namespace fieldmark::cli
