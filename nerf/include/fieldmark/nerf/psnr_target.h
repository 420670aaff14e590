#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/renderer.h>

namespace fieldmark::nerf {

/// Stops training early once the field reaches a PSNR.
class PsnrTarget {
 public:
  static constexpr Index kViews = 4;    ///< held-out views that count
  static constexpr Index kEvery = 250;  ///< steps between evaluations
  /// @param psnr  dB; 0 never stops   @param held_out  views to evaluate; none: the PSNR of the training rays
  /// is used
  PsnrTarget(const RadianceField& field, double psnr, std::optional<Dataset> held_out);
  /// Returns true if the field reaches the target. Evaluates held-out views every kEvery steps, however long
  /// these take.
  /// @param steps  of the training so far   @param train_psnr  see Trainer::train_psnr()
  bool reached(Index steps, double train_psnr);

 private:
  double psnr_;
  std::optional<Dataset> held_out_;
  Renderer renderer_;
  Index evaluated_ = 0;  // steps
};

}  // namespace fieldmark::nerf
