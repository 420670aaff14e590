#pragma once
#include <fieldmark/engine/shape.h>

namespace fieldmark::nerf {

/// Length of a run and its step sizes.
struct ScheduleOptions {
  Index steps = 0;           ///< length of the run in steps; 0: by time
  double seconds = 60;       ///< length of the run in seconds, where steps is 0, > 0
  double lr = 2e-2;          ///< step size at the start, > 0
  double half_after = 8000;  ///< steps after which 1 / (1 + n / half_after) has halved the step size, > 0
  double cooldown =
      0.3;  ///< the last part of the run, in (0, 1), over which the step size falls exponentially ...
  double last = 0.03;  ///< ... to this fraction of what it was, in (0, 1]
};

/// The step size of a run whose length is given in steps or in seconds.
///   lr(n) = lr / (1 + n / half_after) * last^max(0, (n - n_c) / (N - n_c)),   n_c = floor((1 - cooldown) N)
/// A timed run looks at the clock to decide at which step the last part begins, which fixes N. While the pace
/// stays, it looks for nothing else, so that N given as steps has the same step sizes, and gives the same
/// bytes. Where the pace changes so much that N steps would end before 0.95 or after 1.02 of the time, N
/// becomes what the rest of the time allows, and the formula goes on with it: such a run is not repeated by
/// steps.
class Schedule {
 public:
  /// @throws ValueError if an option is out of range
  explicit Schedule(const ScheduleOptions& options);
  /// Called before each step n with the time since the start: a timed run fixes its total here, when what is
  /// left of the time is what the last part takes at the pace of the steps so far, late ones counting more;
  /// or fixes it anew.
  void observe(Index n, double seconds);
  /// Step size of step n, counted from 0.
  double lr(Index n) const;
  /// N; 0 while a timed run has not fixed it.
  Index total() const { return total_; }
  /// Whether N was fixed anew, so that the steps before had the step sizes of another N.
  bool replanned() const { return replanned_; }
  /// Whether the run ends before step n.
  bool done(Index n) const { return total_ > 0 && n >= total_; }
  /// Continues a run whose total was fixed already: it stays, since the clock of the run before is not known.
  /// @param total  0: not fixed
  void resume(Index total);

 private:
  ScheduleOptions options_;
  Index total_ = 0, last_step_ = -1, timed_steps_ = 0;
  double last_seconds_ = 0, pace_ = 0;
  bool fixed_, replanned_ = false;  // fixed: for good
};

}  // namespace fieldmark::nerf
