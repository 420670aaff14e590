#pragma once
#include <fieldmark/nerf/trainer.h>

#include <functional>

namespace fieldmark::bench {

/// Returns the share of a schedule that is done, 0 to 1: of its steps if it has any, else of its seconds.
/// @param steps  taken   @param seconds  passed
double part_done(const ScheduleOptions& schedule, Index steps, double seconds);

/// Trains to the end of the schedule by the clock.
/// @param schedule  the trainer's   @param progress  called before each step with the share done, must not be
///                  empty; may throw to stop
void train_to_end(nerf::Trainer& trainer, const ScheduleOptions& schedule,
                  const std::function<void(double)>& progress);

}  // namespace fieldmark::bench
