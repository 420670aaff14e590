#pragma once
#include <fieldmark/nerf/dataset.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// One implementation of a piece of work, compared with faster or more exact ones.
struct PrecisionRow {
  std::string work;     ///< the task
  std::string variant;  ///< the implementation; the first of each work is the baseline
  double seconds = 0;   ///< median
  double speedup = 1;   ///< relative to the first variant
  double error = 0;     ///< as defined by `measure`
  std::string measure;  ///< what `error` is, and against what
};

/// Settings of run_precision_bench().
struct PrecisionBenchOptions {
  int runs = 5;      ///< per row; the median counts; at least 1
  double scale = 1;  ///< scales the numbers of samples, steps and pixels, in (0, 1]: for tests
  /// The data a field is trained on and rendered from, and the views that evaluate training; both null: the
  /// built-in scene of 200 x 200 pixels.
  const nerf::Dataset* train = nullptr;
  const nerf::Dataset* test = nullptr;  ///< see train
};

/// Measures speed and error of each precision and approximation in use: layers in double, float and bf16; the
/// kernels' exponential; Winograd convolution; early ray termination and a rounded field in rendering; a
/// threshold and bf16 in training.
/// @param progress  called before each work with its name
/// @throws ValueError if an option is out of range, or only one of train and test is given
std::vector<PrecisionRow> run_precision_bench(const PrecisionBenchOptions& options = {},
                                              const std::function<void(const std::string&)>& progress = {});

}  // namespace fieldmark::bench
