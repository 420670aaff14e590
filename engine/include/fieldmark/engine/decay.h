#pragma once
#include <fieldmark/engine/shape.h>

namespace fieldmark {

// Step-size factors at step n >= 0, for the lr_factor of an optimiser's step(). Multiply them to
// combine them: warm_up(n, 100) * cosine_decay(n, 10000). Schedule (schedule.h) is for runs planned by time.
// @throws ValueError if n is negative or another argument is out of range

/// Decays along half a cosine from 1 at step 0 to `last` at step `steps` and after.
///   last + (1 - last) (1 + cos(pi min(n, steps) / steps)) / 2
/// Source: Loshchilov and Hutter 2017 (SGDR), eq. 5, without restarts.
/// @param steps  > 0   @param last  in [0, 1]
double cosine_decay(Index n, Index steps, double last = 0);

/// Decays in steps: factor^floor(n / every).
/// @param every  steps between two decays, > 0   @param factor  in (0, 1]
double step_decay(Index n, Index every, double factor = 0.1);

/// Decays exponentially: factor^n.
/// @param factor  per step, in (0, 1]
double exponential_decay(Index n, double factor);

/// Rises linearly from 1 / steps at step 0 to 1 at step steps - 1 and after.
///   min(1, (n + 1) / steps)
/// @param steps  >= 0; 0: always 1
double warm_up(Index n, Index steps);

}  // namespace fieldmark
