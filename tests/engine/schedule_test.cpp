#include <fieldmark/core/error.h>
#include <fieldmark/engine/schedule.h>

#include <cmath>
#include <vector>

#include "support/catch.h"

using namespace fieldmark;

namespace {
// Returns the step sizes of a timed run whose step times are given by `seconds_of_step`.
template <class F>
std::pair<std::vector<double>, Index> timed_run(ScheduleOptions options, F seconds_of_step) {
  Schedule schedule(options);
  std::vector<double> lr;
  double now = 0;
  for (Index n = 0; !schedule.done(n); ++n) {
    schedule.observe(n, now);
    lr.push_back(schedule.lr(n));
    now += seconds_of_step(n);
    REQUIRE(n < 1000000);
  }
  return {lr, schedule.total()};
}
}  // namespace

TEST_CASE("schedule: the step size by its formula") {
  const Schedule s({.steps = 1000, .lr = 0.01, .half_after = 500, .cooldown = 0.25, .last = 0.1});
  CHECK(s.lr(0) == 0.01);
  CHECK(std::abs(s.lr(500) - 0.005) < 1e-17);
  CHECK(std::abs(s.lr(750) - 0.01 / 2.5) < 1e-17);
  CHECK(std::abs(s.lr(875) - 0.01 / 2.75 * std::sqrt(0.1)) < 1e-17);
  CHECK(std::abs(s.lr(1000) - 0.01 / 3 * 0.1) < 1e-17);
  CHECK(s.total() == 1000);
  CHECK_FALSE(s.done(999));
  CHECK(s.done(1000));
}

TEST_CASE("schedule: a timed run's total, given as steps, has the same step size at every step") {
  for (const double cooldown : {0.1, 0.3, 0.4, 0.5, 0.77})
    for (const double step_time : {0.011, 0.0507, 0.31}) {
      CAPTURE(cooldown, step_time);
      const ScheduleOptions options{.seconds = 60, .cooldown = cooldown};
      const auto [lr, total] = timed_run(
          options, [&](Index n) { return step_time * (1 + 0.3 * std::sin(static_cast<double>(n))); });
      REQUIRE(static_cast<Index>(lr.size()) == total);
      ScheduleOptions fixed = options;
      fixed.steps = total;
      const Schedule again(fixed);
      for (Index n = 0; n < total; ++n) CHECK(lr[static_cast<std::size_t>(n)] == again.lr(n));
    }
}

TEST_CASE("schedule: a timed run ends within 5% of its time, also where the step_time drifts") {
  for (const double drift : {-0.3, 0.0, 0.3}) {
    double end = 0;
    timed_run({.seconds = 60}, [&](Index n) {
      const double seconds = 0.02 * (1 + drift * std::min(1.0, static_cast<double>(n) / 1500));
      end += seconds;
      return seconds;
    });
    CAPTURE(drift, end);
    CHECK(end < 60 * 1.05);
    CHECK(end > 60 * 0.9);
  }
}

TEST_CASE("schedule: a timed run is planned anew where the step_time changes after its total was fixed") {
  // An mlp field's total is fixed after a tenth of the time.
  for (const double cooldown : {0.3, 0.9})
    for (const double slower : {0.25, 0.5, 1.0, 2.0, 5.0})
      for (const double when : {0.2, 0.8}) {
        CAPTURE(cooldown, slower, when);
        const ScheduleOptions options{.seconds = 1800, .cooldown = cooldown};
        Schedule schedule(options);
        double now = 0;
        Index n = 0;
        for (; !schedule.done(n); ++n) {
          schedule.observe(n, now);
          now += 0.5 * (now > when * options.seconds ? slower : 1);
        }
        CHECK(now < 1.03 * options.seconds);
        CHECK(now > 0.89 * options.seconds);
        CHECK(n == schedule.total());
        // The final step size equals that of a run limited by steps.
        ScheduleOptions fixed = options;
        fixed.steps = n;
        CHECK(schedule.lr(n - 1) == Schedule(fixed).lr(n - 1));
        if (slower == 1) CHECK_FALSE(schedule.replanned());
        if (cooldown == 0.9 && slower != 1) CHECK(schedule.replanned());
      }
}

TEST_CASE("schedule: a timed run of few slow steps ends at its time, at the latest after the step begun") {
  for (const double step_time : {0.7, 3.0, 25.0}) {
    double end = 0;
    const auto [lr, total] = timed_run({.seconds = 60}, [&](Index) { return end += step_time, step_time; });
    CAPTURE(step_time, total, end);
    CHECK(end < 60 * 1.02 + step_time);
    CHECK(end > 60 * 0.9 - step_time);
  }
}

TEST_CASE("schedule: a resumed timed run keeps its total") {
  Schedule s({.seconds = 60});
  s.resume(500, true);
  CHECK(s.replanned());
  s.resume(500, false);
  for (const auto& [n, now] : {std::pair<Index, double>{480, 1000}, {481, 1001}, {482, 1100}})
    s.observe(n, now);
  CHECK(s.total() == 500);
  CHECK_FALSE(s.replanned());
  s = Schedule({.seconds = 60});
  s.resume(0, false);
  for (Index n = 480; n < 483; ++n) s.observe(n, 59.0 + static_cast<double>(n - 480));
  CHECK(s.total() == 483);  // it was not fixed before, and the time is over
  Schedule fixed({.steps = 300});
  fixed.resume(500, false);
  CHECK(fixed.total() == 300);
}

TEST_CASE("schedule: errors name option and value") {
  CHECK_THROWS_WITH(Schedule({.steps = -1}), Contains("[schedule] steps must be at least 0, got -1"));
  CHECK_THROWS_WITH(Schedule({.seconds = 0}),
                    Contains("[schedule] seconds must be positive and finite, got 0"));
  CHECK_THROWS_AS(Schedule({.seconds = INFINITY}), ValueError);
  CHECK_THROWS_WITH(Schedule({.lr = -1}), Contains("[schedule] lr must be positive, got -1"));
  CHECK_THROWS_WITH(Schedule({.half_after = 0}), Contains("[schedule] half_after must be positive"));
  CHECK_THROWS_WITH(Schedule({.cooldown = 1}),
                    Contains("[schedule] cooldown must be above 0 and below 1, got 1"));
  CHECK_THROWS_WITH(Schedule({.last = 0}), Contains("[schedule] last must be above 0 and at most 1, got 0"));
  CHECK_THROWS_WITH(Schedule({.cooldown = 1.25}),
                    "[schedule] cooldown must be above 0 and below 1, got 1.25");
  CHECK_THROWS_WITH(Schedule({.steps = -1}), "[schedule] steps must be at least 0, got -1");
  CHECK_THROWS_WITH(Schedule({.lr = -1e-9}), "[schedule] lr must be positive, got -1e-09");
  Schedule ten({.steps = 10, .seconds = 0});
  CHECK_THROWS_AS(ten.lr(-1), ValueError);
  CHECK_THROWS_WITH(ten.done(-1), "[schedule] n must be at least 0, got -1");
  CHECK_THROWS_WITH(ten.observe(-1, 0), "[schedule] n must be at least 0, got -1");
  CHECK_THROWS_WITH(ten.observe(0, -0.5), "[schedule] seconds must be finite and at least 0, got -0.5");
  CHECK_THROWS_WITH(ten.observe(0, std::nan("")), Contains("seconds must be finite and at least 0, got"));
  CHECK_THROWS_WITH(ten.resume(-1, false), "[schedule] total must be at least 0, got -1");
  CHECK_THROWS_WITH(ten.lr(-1), "[schedule] n must be at least 0, got -1");
}
