#pragma once
#include <fieldmark/engine/shape.h>

namespace fieldmark {

/// Length of a run and its step sizes.
struct ScheduleOptions {
  Index steps = 0;           ///< length of the run in steps; 0: by time
  double seconds = 60;       ///< length of the run in seconds, where steps is 0, > 0
  double lr = 2e-2;          ///< step size at the start, > 0
  double half_after = 8000;  ///< steps after which 1 / (1 + n / half_after) has halved the step size, > 0
  double cooldown = 0.3;  ///< last part of the run, in (0, 1), over which the step size falls exponentially
  double last = 0.03;     ///< factor that the step size reaches at the end of the cooldown, in (0, 1]
};

/// The step size of a run whose length is given in steps or in seconds.
///   lr(n) = lr / (1 + n / half_after) * last^max(0, (n - n_c) / (N - n_c)),   n_c = floor((1 - cooldown) N)
/// A timed run measures its steps and fixes N when the cooldown has to begin. A run of N steps then has the
/// same step sizes and gives the same bytes. If the steps become so much slower or faster that N steps would
/// end before 0.95 or after 1.02 of the time, the schedule fixes another N for the time left; no number of
/// steps repeats such a run.
class Schedule {
 public:
  /// @throws ValueError if an option is out of range
  explicit Schedule(const ScheduleOptions& options);
  /// Notes the time before step n, from which a timed run plans its total; recent steps weigh more.
  /// @param seconds  since the start of the run
  void observe(Index n, double seconds);
  /// Step size of step n, counted from 0.
  double lr(Index n) const;
  /// N; 0 while a timed run has not fixed it.
  Index total() const { return total_; }
  /// Whether N was fixed anew, so that the steps before had the step sizes of another N.
  bool replanned() const { return replanned_; }
  /// Whether the run ends before step n.
  bool done(Index n) const { return total_ > 0 && n >= total_; }
  /// Resumes a run. A total that is fixed stays, since the clock of the earlier process is not known.
  /// @param total  0: not fixed
  void resume(Index total);
  /// The options given to the constructor.
  const ScheduleOptions& options() const { return options_; }

 private:
  ScheduleOptions options_;
  Index total_ = 0, last_step_ = -1, timed_steps_ = 0;
  double last_seconds_ = 0, step_seconds_ = 0;
  bool fixed_, replanned_ = false;  // fixed: for good
};

}  // namespace fieldmark
