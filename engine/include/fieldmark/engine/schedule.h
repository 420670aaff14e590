#pragma once
#include <fieldmark/engine/shape.h>

namespace fieldmark {

/// Length of a run and its step sizes.
struct ScheduleOptions {
  Index steps = 0;           ///< length of the run in steps; 0: timed
  double seconds = 60;       ///< length of the run in seconds if steps is 0, > 0
  double lr = 2e-2;          ///< step size at the start, > 0
  double half_after = 8000;  ///< steps after which 1 / (1 + n / half_after) has halved the step size, > 0
  double cooldown = 0.3;  ///< final fraction of the run, in (0, 1), where the step size falls exponentially
  double last = 0.03;     ///< factor that the step size reaches at the end of the cooldown, in (0, 1]
};

/// Computes the step sizes of a run whose length is given in steps or in seconds.
///   lr(n) = lr / (1 + n / half_after) * last^max(0, (n - n_c) / (N - n_c)),   n_c = floor((1 - cooldown) N)
/// A timed run measures its steps and fixes N when the cooldown must begin. A run of N steps then has the
/// same step sizes and gives the same bytes. If the steps become so much slower or faster that N steps would
/// end before 0.95 or after 1.02 of the time, the schedule fixes another N for the remaining time; no number
/// of steps reproduces such a run.
class Schedule {
 public:
  /// @throws ValueError if an option is out of range
  explicit Schedule(const ScheduleOptions& options);
  /// Records the time before step n, from which a timed run plans its total. Recent steps weigh more.
  /// @param n  counted from 0   @param seconds  since the start of the run, finite, at least 0
  /// @throws ValueError if n or seconds is out of range
  void observe(Index n, double seconds);
  /// Returns the step size of step n, counted from 0.   @throws ValueError if n is negative
  double lr(Index n) const;
  /// Returns N, or 0 until a timed run has fixed it.
  Index total() const { return total_; }
  /// True if N was fixed anew, so that earlier steps had the step sizes of another N.
  bool replanned() const { return replanned_; }
  /// True if the run ends before step n.   @throws ValueError if n is negative
  bool done(Index n) const;
  /// Resumes a run. A fixed total stays, since the clock of the earlier process is unknown.
  /// @param total  0: not fixed   @param replanned  of the earlier process   @throws ValueError if total is
  /// negative
  void resume(Index total, bool replanned);
  /// Returns the options given to the constructor.
  const ScheduleOptions& options() const { return options_; }

 private:
  ScheduleOptions options_;
  Index total_ = 0, last_step_ = -1, timed_steps_ = 0;
  double last_seconds_ = 0, step_seconds_ = 0;
  bool fixed_, replanned_ = false;  // fixed: for good
};

}  // namespace fieldmark
