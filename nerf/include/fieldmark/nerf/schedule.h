#pragma once
#include <fieldmark/engine/schedule.h>

namespace fieldmark::nerf {

/// @{
/// Names of version 0.1.
using fieldmark::Schedule;
using fieldmark::ScheduleOptions;
/// @}

}  // namespace fieldmark::nerf
