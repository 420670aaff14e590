#pragma once
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/tools/bench/line_process.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// Options for starting PyTorch.
struct PeerOptions {
  std::string python = "/usr/bin/python3";  ///< interpreter with torch and numpy
  double limit_seconds = 600;               ///< per answer, > 0
};

/// Runs the work of one row in PyTorch, in a separate process. It tries its variants (whole batch,
/// micro-batches, layouts) in two environments; run() times the fastest.
class Peer {
 public:
  /// What the peer reports, and how far its results are from ours.
  struct Found {
    std::string version{};         ///< of PyTorch
    std::string blas{};            ///< library that computes its matrix products
    std::string cpu_capability{};  ///< instruction set of its own loops
    std::string variant{};         ///< the fastest
    int threads = 0;               ///< of the fastest
    bool tuned = false;           ///< the fastest ran in tuned_environment(), else in the default environment
    double seconds = 0;           ///< of the fastest, from the trial
    double untuned_seconds = 0;   ///< of the fastest in the default environment
    double value_difference = 0;  ///< worst |theirs - ours|, relative to the largest magnitude
    /// Likewise for the worst gradient tensor; with draws, on one draw; 0 with metadata "kinks".
    double gradient_difference = 0;
    double kink_difference =
        0;  ///< worst tensor of the whole work, relative to its norm; 0 without draws or kinks
  };
  /// Largest difference of a value or gradient due to rounding, relative to its tensor's largest magnitude.
  static constexpr double kTolerance = 1e-4;
  /// Limit of kink_difference: rounding puts some sums on different sides of a ReLU's kink.
  static constexpr double kKinkTolerance = 0.1;

  /// Starts the interpreter, lets it try its variants, and compares the results of the fastest with ours.
  /// @param row   for error messages
  /// @param work  metadata "network", "parameters" (names in the order of use, separated by commas) and
  /// "draws" (their number), arrays "value/NAME" of each parameter, "x", "u", "y", "dx" and "grad/NAME"; with
  /// draws, the latter five carry the prefix "draw0/", "draw1/" ... of each draw. For training steps: the
  /// data of the network, "y" (the losses of the first steps) and "grad/NAME" (of the first); metadata
  /// "kinks" if so many sums lie near a ReLU's kink that gradients agree by their norms alone
  /// @throws IoError if the interpreter or PyTorch is missing, fails, hangs or gives a malformed answer
  /// @throws Error if results differ by more than kTolerance or kKinkTolerance: wrong work is never timed
  Peer(const std::string& row, const SafetensorsFile& work, const PeerOptions& options);

  /// Returns the variables that the tuned environment sets besides the number of threads: NAME=VALUE,
  /// separated by spaces.
  static std::string tuned_environment();

  /// Returns the findings of the constructor.
  const Found& found() const { return found_; }
  /// Returns the seconds per call, mean over a run. @throws IoError as the constructor
  double run();

 private:
  std::string python_;
  Found found_;
  std::unique_ptr<LineProcess> process_;
};

}  // namespace fieldmark::bench
