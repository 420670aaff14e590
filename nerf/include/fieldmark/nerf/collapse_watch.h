#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/renderer.h>

#include <string>

namespace fieldmark::nerf {

/// Notices a training that has collapsed: a loss that is no number, no occupied cells, or views of fog or one
/// colour, which fit the images worse than a constant image does.
///
/// Renders a few small views of the field at certain steps, which changes nothing about the training.
class CollapseWatch {
 public:
  static constexpr Index kViews = 4;  ///< views that are rendered
  static constexpr Index kPatience =
      3;  ///< looks in a row that must find the views worse than a constant image
  /// @param images  views to compare with, better not of the training; the first kViews of them count
  CollapseWatch(const RadianceField& field, const Dataset& images);
  /// Looks at the training where its step is one of the certain ones.
  /// @param steps  of the training so far   @param train_psnr  see Trainer::train_psnr()
  /// @return what is wrong, a sentence without its end; empty: nothing is, or not for certain yet
  std::string look(Index steps, double train_psnr);
  /// The same at the end of a run, without waiting for later looks; of runs long enough to tell.
  std::string verdict(Index steps);
  /// Share of the images' variance that the field explains, at most 1; below 0 a constant image fits better.
  double explained();

 private:
  struct Truth {
    Camera camera;           // of a few pixels
    std::vector<float> rgb;  // [pixels, 3]
  };
  const RadianceField& field_;
  Renderer renderer_;
  std::vector<Truth> truths_;
  double variance_ = 0;  // of all pixels, a channel
  double last_ = 0;      // explained() at the last look
  Index looked_ = -1;    // steps at the last look
  Index worse_ = 0;      // looks in a row that found a constant image better
};

}  // namespace fieldmark::nerf
