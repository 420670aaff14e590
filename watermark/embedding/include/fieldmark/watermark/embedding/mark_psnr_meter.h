#pragma once
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/renderer.h>

#include <functional>
#include <vector>

namespace fieldmark::watermark {

/// Which views a MarkPsnrMeter looks at: near ones, no larger than the training images. Every pixel is one
/// ray, so that views of few pixels have the mean that large ones have, and many of them come closer to the
/// mean over all views than a few large ones that take as long.
struct MarkPsnrViews {
  Index count = 256;       ///< >= 1
  Index side = 80;         ///< pixels of the longer side at most, >= 1
  std::uint64_t seed = 0;  ///< of the cameras
};

/// How the views are to be rendered: one ray a pixel, of fields with supersampling too, whose mean over a
/// large pixel would hide a part of the mark.
inline nerf::RenderOptions mark_psnr_rendering() { return {.supersampling = 1}; }

/// Measures the mark PSNRs of one field: the mean over views of psnr_masked() of the marked against
/// the unmarked view, dB. It keeps the unmarked views.
class MarkPsnrMeter {
 public:
  /// Renders the views of the unmarked field. @throws ValueError if a number is out of range
  explicit MarkPsnrMeter(const nerf::RadianceField& unmarked, const MarkPsnrViews& views = {});
  /// @param marked  renders the marked field, made with mark_psnr_rendering()   @param before  called with
  /// each view's number before it is rendered, or empty
  /// @param every  1: all views; n: every nth of them, for a first guess
  /// @return mean over the views that have an object and differ, dB; infinity where there is none
  double operator()(nerf::Renderer& marked, const std::function<void(Index view)>& before = {},
                    Index every = 1) const;
  /// A step for first guesses: 8 where that leaves 8 views or more, else 1.
  Index guess_step() const { return std::ssize(cameras_) >= 64 ? 8 : 1; }

 private:
  std::vector<nerf::Camera> cameras_;
  std::vector<nerf::Rendering> unmarked_;
};

}  // namespace fieldmark::watermark
