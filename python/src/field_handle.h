#pragma once
#include <fieldmark/engine/training_run.h>

#include <functional>
#include <mutex>

#include "arrays.h"

namespace fieldmark::python {

/// Trains to the end without the interpreter's lock; Ctrl-C raises KeyboardInterrupt.
/// @param progress  None, or a function of the steps and seconds so far
/// @param check     called before each step, without the interpreter's lock; throws to end the run
void run(TrainingRun& training, const py::object& progress, const std::function<void()>& check = {});

/// Held by work without the interpreter's lock: fields and owners pack their weights when they are first
/// used, so only one thread at a time may use them.
std::recursive_mutex& library_lock();

/// Returns f(), computed without the interpreter's lock: other Python threads go on. f must not touch Python
/// objects. Calls do not nest.
template <class F>
auto unlocked(F&& f) {
  const py::gil_scoped_release free;
  const std::lock_guard<std::recursive_mutex> alone(library_lock());
  return f();
}

/// Progress of work in unlocked(); Ctrl-C raises KeyboardInterrupt. Returns true, so that the work goes on.
bool check_signals(Index done, Index total);

}  // namespace fieldmark::python
