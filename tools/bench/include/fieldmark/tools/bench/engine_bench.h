#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/tools/bench/peer.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// A peer's result for a row, timed in alternation with ours.
struct PeerRow {
  double seconds = 0;  ///< median over its runs
  double ratio = 0;    ///< its seconds over ours; above 1, ours is faster
  Peer::Found found;   ///< which of its variants ran, and how close its results are
};

/// One row of the engine benchmark.
struct EngineRow {
  std::string name;            ///< name for scripts: "mlp_4x64_fb_f32"
  std::string what;            ///< description for people
  double seconds = 0;          ///< median per call
  double spread = 0;           ///< (slowest - fastest) / median over the runs
  double gflops = 0;           ///< useful operations, forward and backward; 0 for look-ups
  double ratio_to_peak = 0;    ///< fraction of the peak measured around each run, median; 0 for look-ups
  double rate = 0;             ///< samples, points, images, elements or ops per second
  double gigabytes = 0;        ///< read and written per second, for elementwise chains; else 0
  double ratio_to_memory = 0;  ///< `gigabytes` over the machine's rate of adding two arrays, by turns; else 0
  double speedup = 0;          ///< over the plain scalar loop in the same run; 0 if there is none
  /// Worst |float - double| over values and all gradients, relative to the largest magnitude of each. Over
  /// five sets of images, the convolution reports the worst and the decoder the median; training steps of
  /// models cover the first three losses and the first gradients.
  double error = 0;
  double megabytes = 0;           ///< peak memory of the process so far
  std::optional<PeerRow> peer{};  ///< set if a peer ran the row too
};

/// Options of run_engine_bench().
struct EngineBenchOptions {
  int runs = 5;                       ///< per row; the median counts
  double scale = 1;                   ///< scales the numbers of samples, in (0, 1]: for tests
  std::string only{};                 ///< runs only rows whose name contains this text
  std::optional<PeerOptions> peer{};  ///< PyTorch, for the rows that it supports
  /// Training data of nerf_step*; null: the built-in scene of 200 x 200 pixels.
  const nerf::Dataset* scene = nullptr;
};

/// Result of run_engine_bench().
struct EngineBench {
  double peak_gflops = 0;       ///< of this machine, see peak_gflops()
  std::vector<EngineRow> rows;  ///< in the order of execution
};

/// Measures the peak first, then each row. The shapes are fixed, so that ratios are comparable across
/// machines:
/// - mlp_4x64_fb_f32: 4 dense layers of 64 with bias and ReLU, 262,144 samples, forward and backward with dX
///   and summed weight gradients, in the loop over chunks that training uses; _tape: the whole batch at once
/// - mlp_8x256_fb_f32: 8 of 256, 32,768 samples
/// - conv3x3_64_fb_f32: 3 x 3, 64 to 64 channels, 4 images of 128 x 128
/// - hidden_decoder_fb_f32: 3 to 64, 7 x 64, batch norm, ReLU, average, linear, 4 images of 128 x 128
/// - transformer_step: a training step (forward, backward, Adam) of the model of examples/transformer.cpp;
///   _wide: width 128 on 16 texts of 64 letters
/// - autoencoder_step: likewise for examples/autoencoder.cpp; _wide: 16 and 32 channels, images of 64 x 64
/// - paper_step: likewise for the networks of preset paper, without distortions: 8 images of 80 x 80, half of
///   whose pixels have a sample, with a message each
/// - chain_swish_fb_f32, chain_arithmetic_fb_f32: 3 and 8 elementwise steps on 10^7 elements, fused; three
///   inputs with gradients
/// - node_16_fb_f32: 1,000 products of 16 elements, recorded one by one
/// - hash_2e17_*: 16 levels of 2 + 2 features, 2^17 entries, 16 to 512 cells; points along rays in the order
///   of image tiles, or random points
/// - nerf_step: a complete training step of the default field after it has taken shape, with the number of
///   samples per step after growth (TrainOptions::samples_per_step, from 4,000 steps on); _first: with the
///   smaller number of the first steps (first_samples)
/// With a peer, PyTorch also runs the rows mlp_4x64_fb_f32, mlp_8x256_fb_f32, conv3x3_64_fb_f32,
/// hidden_decoder_fb_f32, chain_* and the training steps of models; its runs alternate with ours. First its
/// results are compared with ours, on the same shapes; where it can, with numbers that keep ReLUs
/// away from their kinks.
/// @param progress  called before each row with its name and the fraction of rows done
/// @throws ValueError if an option is out of range, or a peer is requested and no row supports one
/// @throws IoError, Error  as Peer
EngineBench run_engine_bench(const EngineBenchOptions& options,
                             const std::function<void(const std::string&, double)>& progress = {});

}  // namespace fieldmark::bench
