#pragma once
#include <fieldmark/engine/safetensors.h>
#include <fieldmark/tools/bench/line_process.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// How PyTorch is started.
struct PeerOptions {
  std::string python = "/usr/bin/python3";  ///< interpreter with torch and numpy
  double limit_seconds = 600;               ///< of each of its answers, > 0
};

/// PyTorch doing the work of one row in a process of its own: it tries its variants (whole batch,
/// micro-batches, layouts) in two environments, and the fastest of all is the one that run() times.
class Peer {
 public:
  /// What the peer said of itself, and how far its results are from ours.
  struct Found {
    std::string version{};         ///< of PyTorch
    std::string blas{};            ///< library that serves its matrix products
    std::string cpu_capability{};  ///< instruction set of its own loops
    std::string variant{};         ///< the fastest
    int threads = 0;               ///< of the fastest
    bool tuned = false;          ///< the fastest ran in tuned_environment(), else in the environment as it is
    double seconds = 0;          ///< of the fastest, when it was tried
    double untuned_seconds = 0;  ///< of the fastest in the environment as it is
    double value_difference = 0;     ///< worst |theirs - ours|, relative to the largest magnitude
    double gradient_difference = 0;  ///< the same, the worst tensor; in works with draws of one of those
    double kink_difference = 0;      ///< in works with draws: of the whole work, in parts of the norm
  };
  /// Largest difference of a value or gradient that rounding explains, relative to the largest magnitude of
  /// its tensor.
  static constexpr double kTolerance = 1e-4;
  /// The same for gradients of a whole work with draws, in parts of the norm: there sums of either program
  /// fall on different sides of a ReLU's kink.
  static constexpr double kKinkTolerance = 0.1;

  /// Starts the interpreter, lets it try its variants, and compares the fastest one's results with ours.
  /// @param row   for error texts
  /// @param work  metadata "network", "parameters" (names in the order of use, commas between) and "draws"
  /// (their
  ///              number), arrays "value/NAME" of each parameter, "x", "u", "y", "dx" and "grad/NAME", and
  ///              the latter five behind "draw0/", "draw1/" ... of each draw; for steps of training the data
  ///              of the network, "y" (the losses of the first steps) and "grad/NAME" (of the first)
  /// @throws IoError if the interpreter or PyTorch is missing, fails, hangs or answers nonsense
  /// @throws Error if results differ by more than kTolerance or kKinkTolerance: wrong work is not timed
  Peer(const std::string& row, const SafetensorsFile& work, const PeerOptions& options);

  /// What is set for the better of the two environments, besides the number of threads: NAME=VALUE with
  /// spaces.
  static std::string tuned_environment();

  /// As of construction.
  const Found& found() const { return found_; }
  /// Seconds of a call, mean over a run. @throws IoError as the constructor
  double run();

 private:
  std::string python_;
  Found found_;
  std::unique_ptr<LineProcess> process_;
};

}  // namespace fieldmark::bench
