#pragma once
#include <fieldmark/engine/training_run.h>

#include "arrays.h"

namespace fieldmark::python {

/// Trains to the end; Ctrl-C raises KeyboardInterrupt.
/// @param progress  None, or a function of the steps and seconds so far
void run(TrainingRun& training, const py::object& progress);

}  // namespace fieldmark::python
