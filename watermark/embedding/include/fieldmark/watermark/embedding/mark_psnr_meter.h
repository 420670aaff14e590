#pragma once
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/renderer.h>

#include <functional>
#include <vector>

namespace fieldmark::watermark {

/// Views that a MarkPsnrMeter measures: novel views, no larger than the training images. Every pixel is one
/// ray, so small views have the same mean as large ones, and many small views estimate the mean over all
/// views better than a few large ones of the same cost.
struct MarkPsnrViews {
  Index count = 256;       ///< >= 1
  Index side = 80;         ///< pixels of the longer side at most, >= 1
  std::uint64_t seed = 0;  ///< of the cameras
};

/// Options for rendering the views: one ray per pixel, even for fields with supersampling, because averaging
/// over a large pixel would hide a part of the mark.
inline nerf::RenderOptions mark_psnr_rendering() { return {.supersampling = 1}; }

/// Measures the mark PSNR of one field: the mean over views of psnr_masked() of the marked against the
/// unmarked view, dB. Keeps the unmarked views.
class MarkPsnrMeter {
 public:
  /// Renders the views of the unmarked field. @throws ValueError if a number is out of range
  explicit MarkPsnrMeter(const nerf::RadianceField& unmarked, const MarkPsnrViews& views = {});
  /// Measures the mark PSNR.
  /// @param marked  renders the marked field, made with mark_psnr_rendering()   @param before  called with
  /// each view's number before it is rendered, or empty
  /// @param every  1: all views; n: every nth view, for a first guess
  /// @return mean over the views that show an object and differ, dB; infinity if there are none
  double operator()(nerf::Renderer& marked, const std::function<void(Index view)>& before = {},
                    Index every = 1) const;
  /// Returns `every` for first guesses: 8 if that leaves at least 8 views, else 1.
  Index guess_step() const { return std::ssize(cameras_) >= 64 ? 8 : 1; }

 private:
  std::vector<nerf::Camera> cameras_;
  std::vector<nerf::Rendering> unmarked_;
};

}  // namespace fieldmark::watermark
