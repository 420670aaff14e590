#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/schedule.h>

#include <algorithm>
#include <cmath>

namespace fieldmark {
namespace {
constexpr double kReserve = 0.965;             // of the time: cooldown steps may be slower
constexpr double kEarly = 0.95, kLate = 1.02;  // of the time; a run that would end outside gets a new total
constexpr double kNewest = 0.014;              // weight of a step in step_seconds_: averages about 70 steps

void require_count(const char* name, Index n) { check_number("schedule", name, n, n >= 0, "at least 0"); }
}  // namespace

Schedule::Schedule(const ScheduleOptions& o) : options_(o), total_(o.steps), fixed_(o.steps > 0) {
  const auto require = [](const char* name, auto value, bool ok, const char* want) {
    check_number("schedule", name, value, ok, want);
  };
  require("steps", o.steps, o.steps >= 0, "at least 0");
  require("seconds", o.seconds, o.steps > 0 || (o.seconds > 0 && std::isfinite(o.seconds)),
          "positive and finite");
  require("lr", o.lr, o.lr > 0, "positive");
  require("half_after", o.half_after, o.half_after > 0, "positive");
  require("cooldown", o.cooldown, o.cooldown > 0 && o.cooldown < 1, "above 0 and below 1");
  require("last", o.last, o.last > 0 && o.last <= 1, "above 0 and at most 1");
}

void Schedule::observe(Index n, double seconds) {
  require_count("n", n);
  check_number("schedule", "seconds", seconds, seconds >= 0 && std::isfinite(seconds),
               "finite and at least 0");
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
