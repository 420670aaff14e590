#pragma once
#include <fieldmark/tools/bench/embed_variants.h>

#include <functional>

namespace fieldmark::bench {

/// What a mark reached on the way.
struct EmbedPoint {
  double seconds = 0;          ///< of embedding so far
  double accuracy = 0;         ///< blind bit accuracy of one view, mean over a third of the views
  double psnr_foreground = 0;  ///< of marked against unmarked on the object, dB, mean over them
};

/// What a variant reached. Accuracies are blind ones of one view, means over views that were not learnt from.
struct EmbedRow {
  EmbedVariant variant;        ///< how it was embedded
  Index steps = 0;             ///< taken
  double cache_seconds = 0;    ///< of rendering what is learnt from, part of `seconds`
  double seconds = 0;          ///< of embedding: views, training, the calibration of the strength
  double accuracy = 0;         ///< novel cameras
  double accuracy_p5 = 0;      ///< 5th percentile over them
  double psnr_foreground = 0;  ///< of marked against unmarked on the object, dB, novel cameras
  double closer = 0;           ///< accuracy of a third as many closer cameras, see nerf::CameraSet
  double farther = 0;          ///< ... of farther ones
  double extrapolated = 0;     ///< ... of cameras more than 30 degrees from every training direction
  watermark::Embedder::Figures figures{};  ///< under the distortions of training, at its end
  std::vector<EmbedPoint> curve{};         ///< on the way, the end included
  bool front = false;                      ///< no other one beats it, see mark_front()
};

/// What counts as equal in mark_front(): what another seed changes.
struct EmbedMargin {
  double time = 0.08;      ///< part of a time, in [0, 1)
  double accuracy = 0.01;  ///< part of the bits, >= 0
  double psnr = 0.2;       ///< dB, >= 0
};

/// How variants are judged.
struct EmbedBenchOptions {
  Index views = 24;        ///< novel cameras, at least 1; a third as many on the way and of other cameras
  Index size = 0;          ///< pixels of their longer side; 0: as the field was trained
  Index points = 4;        ///< of a curve, at least 1
  std::uint64_t seed = 1;  ///< of cameras and messages
};

/// Embeds a mark in every way, one after another. The clock stands still while a mark is judged. Views are
/// cached once for variants that share them, and their time counts for each.
/// @param progress  called before every step with what is done and the part that is done; may throw to stop
/// @throws ValueError if an option is out of range
std::vector<EmbedRow> run_embed_bench(const nerf::RadianceField& field,
                                      const std::vector<EmbedVariant>& variants,
                                      const EmbedBenchOptions& options = {},
                                      const std::function<void(const std::string&, double)>& progress = {});

/// Marks the rows that no other beats in time, accuracy and PSNR together, see pareto_front().
void mark_front(std::vector<EmbedRow>& rows, const EmbedMargin& margin = {});

/// Where the default, the first row, stands, and what beats it.
/// @param margin  as the front was marked with   @throws ValueError if there are no rows
std::string judgement(const std::vector<EmbedRow>& rows, const EmbedMargin& margin = {});

}  // namespace fieldmark::bench
