#pragma once
#include <fieldmark/engine/tensor_stats.h>

#include <vector>

#include "arrays.h"

namespace fieldmark::python {

/// Returns statistics by name: {"w": {"count": ..., "mean": ...}}.
inline py::dict as_dict(const std::vector<TensorStats>& all) {
  using namespace py::literals;
  py::dict named;
  for (const TensorStats& s : all)
    named[py::str(s.name)] = py::dict("count"_a = s.count, "zeros"_a = s.zeros, "nonfinite"_a = s.nonfinite,
                                      "mean"_a = s.mean, "rms"_a = s.rms, "largest"_a = s.largest);
  return named;
}

}  // namespace fieldmark::python
