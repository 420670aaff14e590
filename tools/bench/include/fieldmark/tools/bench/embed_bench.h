#pragma once
#include <fieldmark/tools/bench/embed_variants.h>

#include <functional>

namespace fieldmark::bench {

/// An intermediate result of a mark.
struct EmbedPoint {
  double seconds = 0;          ///< spent on embedding so far
  double accuracy = 0;         ///< blind bit accuracy of one view, mean over a third of the views
  double psnr_foreground = 0;  ///< marked against unmarked on the foreground, dB, mean over the same views
};

/// Result of a variant. Accuracies are blind, for one view, averaged over views that were not trained on.
struct EmbedRow {
  EmbedVariant variant;        ///< how it was embedded
  Index steps = 0;             ///< taken
  double cache_seconds = 0;    ///< spent on rendering training views, part of `seconds`
  double seconds = 0;          ///< spent on embedding: views, training, calibration of the mark PSNR
  double accuracy = 0;         ///< novel cameras
  double accuracy_p5 = 0;      ///< 5th percentile over novel cameras
  double psnr_foreground = 0;  ///< marked against unmarked on the foreground, dB, novel cameras
  double closer = 0;           ///< accuracy for a third as many closer cameras, see nerf::CameraSet
  double farther = 0;          ///< likewise for farther cameras
  double extrapolated = 0;     ///< likewise for cameras more than 30 degrees from every training direction
  watermark::Embedder::Figures figures{};  ///< under the distortions of training, at its end
  std::vector<EmbedPoint> curve{};         ///< intermediate results, including the end
  bool front = false;                      ///< no other variant beats it, see mark_front()
};

/// Differences that count as equal in mark_front(): the variation between seeds.
struct EmbedMargin {
  double time = 0.08;      ///< relative, in [0, 1)
  double accuracy = 0.01;  ///< fraction of the bits, >= 0
  double psnr = 0.2;       ///< dB, >= 0
};

/// Options for judging variants.
struct EmbedBenchOptions {
  Index views = 24;        ///< novel cameras, at least 1; a third as many for the curve and other camera sets
  Index size = 0;          ///< pixels of their longer side; 0: as in training
  Index points = 4;        ///< per curve, at least 1
  std::uint64_t seed = 1;  ///< seed of cameras and messages
};

/// Embeds a mark with every variant, one after another. The clock stops while a mark is judged. Variants that
/// share views share one cache, whose time counts for each.
/// @param progress  called before every step with the task and the fraction done; may throw to stop
/// @throws ValueError if an option is out of range
std::vector<EmbedRow> run_embed_bench(const nerf::RadianceField& field,
                                      const std::vector<EmbedVariant>& variants,
                                      const EmbedBenchOptions& options = {},
                                      const std::function<void(const std::string&, double)>& progress = {});

/// Marks the rows that no other row beats in time, accuracy and PSNR together, see pareto_front().
void mark_front(std::vector<EmbedRow>& rows, const EmbedMargin& margin = {});

/// Describes the position of the default, the first row, and what beats it.
/// @param margin  with which the front was marked   @throws ValueError if there are no rows
std::string judgement(const std::vector<EmbedRow>& rows, const EmbedMargin& margin = {});

}  // namespace fieldmark::bench
