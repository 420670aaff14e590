#pragma once
#include <fieldmark/nerf/dataset.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// One way of doing a piece of work, beside others that are faster or more exact.
struct PrecisionRow {
  std::string work;     ///< what is done
  std::string variant;  ///< how: the first of a work is what the others are compared with
  double seconds = 0;   ///< median
  double speedup = 1;   ///< over the first variant's time
  double error = 0;     ///< in the sense of `measure`
  std::string measure;  ///< what `error` is, and against what
};

/// Settings of run_precision_bench().
struct PrecisionBenchOptions {
  int runs = 5;      ///< of each row, whose median counts, at least 1
  double scale = 1;  ///< of the numbers of samples, steps and pixels, in (0, 1]: for tests
  /// What a field is trained on and rendered from, and the views that training is judged by; both null: the
  /// built-in scene of 200 x 200 pixels.
  const nerf::Dataset* train = nullptr;
  const nerf::Dataset* test = nullptr;  ///< see train
};

/// Speed against error of each precision and each approximation in use: layers in double, float and bf16; the
/// exponential of the kernels; Winograd's convolution; rays that end early and a rounded field in rendering;
/// a threshold and bf16 in training.
/// @param progress  called before each work with its name
/// @throws ValueError if an option is out of range, or only one of train and test is given
std::vector<PrecisionRow> run_precision_bench(const PrecisionBenchOptions& options = {},
                                              const std::function<void(const std::string&)>& progress = {});

}  // namespace fieldmark::bench
