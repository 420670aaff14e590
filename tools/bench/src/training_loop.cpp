#include "training_loop.h"

#include <algorithm>

#include "timing.h"

namespace fieldmark::bench {

double part_done(const ScheduleOptions& schedule, Index steps, double seconds) {
  const double part = schedule.steps > 0 ? static_cast<double>(steps) / static_cast<double>(schedule.steps)
                                         : seconds / schedule.seconds;
  return std::min(1.0, part);
}

void train_to_end(nerf::Trainer& trainer, const ScheduleOptions& schedule,
                  const std::function<void(double)>& progress) {
  const double begin = now();
  while (!trainer.done()) {
    const double seconds = now() - begin;
    progress(part_done(schedule, trainer.steps(), seconds));
    trainer.step(seconds);
  }
}

}  // namespace fieldmark::bench
