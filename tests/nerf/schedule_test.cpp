#include <fieldmark/nerf/schedule.h>

#include <concepts>

#include "support/catch.h"

TEST_CASE("nerf schedule: the names of version 0.1 are those of engine") {
  CHECK(std::same_as<fieldmark::nerf::Schedule, fieldmark::Schedule>);
  CHECK(std::same_as<fieldmark::nerf::ScheduleOptions, fieldmark::ScheduleOptions>);
}
