#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/renderer.h>

#include <limits>
#include <string>

namespace fieldmark::nerf {

/// Detects a collapsed training: a loss that is not a number, no occupied cells, or views of fog or of one
/// colour, which fit the images worse than a constant image does.
///
/// Renders a few small views of the field from time to time, without affecting the training.
class CollapseWatch {
 public:
  static constexpr Index kViews = 4;  ///< views rendered per look
  static constexpr Index kPatience =
      3;  ///< looks in a row that must find the views worse than a constant image
  /// @param images  views to compare with, preferably not training views; only the first kViews are used
  CollapseWatch(const RadianceField& field, const Dataset& images);
  /// Checks the training if a look is due: after a number of steps, or, for hash fields, after a few seconds,
  /// so that slow steps do not delay it.
  /// @param steps  of the training so far   @param train_psnr  see Trainer::train_psnr()
  /// @param seconds  since any fixed time
  /// @return what is wrong, a sentence without full stop; empty: nothing, or not yet certain
  std::string look(Index steps, double train_psnr, double seconds);
  /// Checks at the end of a run, without waiting for further looks; empty for runs too short to tell.
  std::string verdict(Index steps);
  /// Returns the share of the images' variance that the field explains, at most 1; below 0 a constant image
  /// fits better.
  double explained();

 private:
  struct Truth {
    Camera camera;           // of a few pixels
    std::vector<float> rgb;  // [pixels, 3]
  };
  const RadianceField& field_;
  Renderer renderer_;
  std::vector<Truth> truths_;
  double variance_ = 0;                                          // of all pixels, per channel
  double last_ = 0;                                              // explained() at the last look
  Index looked_ = 0;                                             // steps at the last look
  double looked_at_ = std::numeric_limits<double>::quiet_NaN();  // seconds at the last look or the first call
  Index worse_ = 0;  // looks in a row that found a constant image better
};

}  // namespace fieldmark::nerf
