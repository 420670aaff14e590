#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/tools/bench/peer.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// A peer's side of a row, timed by turns with ours.
struct PeerRow {
  double seconds = 0;  ///< median of its runs
  double ratio = 0;    ///< seconds over ours: above 1, ours is the faster
  Peer::Found found;   ///< which of its variants ran, and how close it is
};

/// One line of the engine's benchmark.
struct EngineRow {
  std::string name;            ///< as in scripts: "mlp_4x64_fb_f32"
  std::string what;            ///< for people
  double seconds = 0;          ///< median of a call
  double spread = 0;           ///< (slowest - fastest) / median over the runs
  double gflops = 0;           ///< useful operations, forward and backward; 0 for look-ups
  double ratio_to_peak = 0;    ///< over the peak measured around each run, median; 0 for look-ups
  double rate = 0;             ///< samples, points, images, elements or ops a second
  double gigabytes = 0;        ///< read and written a second, in elementwise chains; else 0
  double ratio_to_memory = 0;  ///< that over the machine's rate of adding two arrays, by turns; else 0
  double speedup = 0;          ///< over the plain scalar loop in the same run; 0 where there is none
  /// Worst |float - double| over values and all gradients, relative to the largest magnitude of each. For the
  /// convolution the worst, for the decoder the median of five sets of images; for training steps of models
  /// over the first three losses and the first gradients.
  double error = 0;
  double megabytes = 0;           ///< most memory of the process so far
  std::optional<PeerRow> peer{};  ///< where a peer did the row too
};

/// Settings of run_engine_bench().
struct EngineBenchOptions {
  int runs = 5;                       ///< of each row, whose median counts
  double scale = 1;                   ///< of the numbers of samples, in (0, 1]: for tests
  std::string only{};                 ///< rows with this text in their name
  std::optional<PeerOptions> peer{};  ///< PyTorch beside the rows it can do
  /// What nerf_step* train on; null: the built-in scene of 200 x 200 pixels.
  const nerf::Dataset* scene = nullptr;
};

/// What run_engine_bench() measured.
struct EngineBench {
  double peak_gflops = 0;       ///< of this machine, see peak_gflops()
  std::vector<EngineRow> rows;  ///< in the order they ran
};

/// Measures the peak first, then each row. The shapes are fixed, so that rows of different machines can be
/// compared by their ratios:
/// - mlp_4x64_fb_f32: 4 dense layers of 64 with bias and ReLU, 262,144 samples, forward and backward with dX
///   and summed weight gradients, in the loop over chunks that training uses; _tape: the whole batch at once
/// - mlp_8x256_fb_f32: 8 of 256, 32,768 samples
/// - conv3x3_64_fb_f32: 3 x 3, 64 to 64 channels, 4 images of 128 x 128
/// - hidden_decoder_fb_f32: 3 to 64, 7 x 64, batch norm, ReLU, average, linear, 4 images of 128 x 128
/// - transformer_step: a training step (forward, backward, Adam) of the model of examples/transformer.cpp;
///   _wide: of width 128 on 16 texts of 64 letters
/// - autoencoder_step: the same of examples/autoencoder.cpp; _wide: of 16 and 32 channels, images of 64 x 64
/// - chain_swish_fb_f32, chain_arithmetic_fb_f32: 3 and 8 elementwise steps on 10^7 elements, fused; three
///   inputs with gradients
/// - node_16_fb_f32: 1,000 products of 16 elements, recorded one by one
/// - hash_2e17_*: 16 levels of 2 + 2 features, 2^17 entries, 16 to 512 cells; points along rays in the order
///   of image tiles, and at random
/// - nerf_step: a training step of the default field once it has taken shape, everything included, with the
///   samples that a run's steps have after growing (TrainOptions::samples_per_step, from 4,000 steps on);
///   _first: with the fewer that its first have (first_samples)
/// @param progress  called before each row with its name and the part of the rows that is done
/// With a peer, the rows mlp_4x64_fb_f32, mlp_8x256_fb_f32, conv3x3_64_fb_f32, hidden_decoder_fb_f32 and
/// chain_*, and those of training steps of models, are done by PyTorch too, a run of ours and a run of its by
/// turns; first its results are compared with ours, on the same shapes and with numbers that keep ReLUs away
/// from their kinks.
/// @throws ValueError if an option is out of range, or a peer is asked for and no row has one
/// @throws IoError, Error  as Peer
EngineBench run_engine_bench(const EngineBenchOptions& options,
                             const std::function<void(const std::string&, double)>& progress = {});

}  // namespace fieldmark::bench
