#include <fieldmark/core/error.h>
#include <fieldmark/engine/schedule.h>

#include <algorithm>
#include <cmath>

#include "number_text.h"

namespace fieldmark {
namespace {
constexpr double kReserve = 0.965;             // of the time: cooldown steps may be slower
constexpr double kEarly = 0.95, kLate = 1.02;  // of the time; a run that would end outside gets a new total
constexpr double kNewest = 0.014;              // weight of a step in step_seconds_: averages about 70 steps

void require_count(const char* name, Index n) {
  if (n < 0)
    throw ValueError("[schedule] " + std::string(name) + " must be at least 0, got " + std::to_string(n));
}
}  // namespace

Schedule::Schedule(const ScheduleOptions& o) : options_(o), total_(o.steps), fixed_(o.steps > 0) {
  const auto require = [](bool ok, const char* what, double got) {
    if (!ok) throw ValueError("[schedule] " + std::string(what) + ", got " + detail::number_text(got));
  };
  require(o.steps >= 0, "steps must not be negative", static_cast<double>(o.steps));
  require(o.steps > 0 || (o.seconds > 0 && std::isfinite(o.seconds)), "seconds must be positive", o.seconds);
  require(o.lr > 0, "lr must be positive", o.lr);
  require(o.half_after > 0, "half_after must be positive", o.half_after);
  require(o.cooldown > 0 && o.cooldown < 1, "cooldown must be between 0 and 1", o.cooldown);
  require(o.last > 0 && o.last <= 1, "last must be above 0 and at most 1", o.last);
}

void Schedule::observe(Index n, double seconds) {
  require_count("n", n);
  if (!(seconds >= 0 && std::isfinite(seconds)))
    throw ValueError("[schedule] seconds must be finite and at least 0, got " + detail::number_text(seconds));
  if (fixed_) return;
  if (last_step_ >= 0 && n > last_step_) {
    const double newest = (seconds - last_seconds_) / static_cast<double>(n - last_step_);
    step_seconds_ += (newest - step_seconds_) * std::max(kNewest, 1 / static_cast<double>(++timed_steps_));
  }
  last_step_ = n;
  last_seconds_ = seconds;
  if (timed_steps_ == 0) return;
  const auto end = [&](Index total) { return seconds + step_seconds_ * static_cast<double>(total - n); };
  if (total_ == 0) {
    const auto total = static_cast<Index>(std::ceil(static_cast<double>(n) / (1 - options_.cooldown)));
    if (end(total) >= kReserve * options_.seconds) total_ = total;
  } else if (end(total_) > kLate * options_.seconds || end(total_) < kEarly * options_.seconds) {
    const double left = (kReserve * options_.seconds - seconds) / std::max(step_seconds_, 1e-9);
    total_ = n + static_cast<Index>(std::clamp(left, 1.0, 1e12));
    replanned_ = true;
  }
}

double Schedule::lr(Index n) const {
  require_count("n", n);
  const double steady = options_.lr / (1 + static_cast<double>(n) / options_.half_after);
  if (total_ == 0) return steady;
  const double begin = std::floor((1 - options_.cooldown) * static_cast<double>(total_));
  const double fraction =
      (static_cast<double>(n) - begin) / std::max(1.0, static_cast<double>(total_) - begin);
  return steady * std::pow(options_.last, std::clamp(fraction, 0.0, 1.0));
}

bool Schedule::done(Index n) const {
  require_count("n", n);
  return total_ > 0 && n >= total_;
}

void Schedule::resume(Index total, bool replanned) {
  require_count("total", total);
  if (options_.steps > 0) return;
  total_ = total;
  replanned_ = replanned;
  fixed_ = total > 0;
}

}  // namespace fieldmark
