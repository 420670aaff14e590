#pragma once
#include <fieldmark/imaging/lpips.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/watermark/payload/message.h>

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::baselines {

/// A marked scene as seen by its measurement, whichever system made it.
struct MarkedScene {
  Index bits = 16;  ///< length of a message
  /// Returns the message of a view; scenes with one or two fixed messages return those.
  std::function<watermark::Message(Index view)> message;
  /// Renders an image [H, W, 3] of the scene with the message.
  std::function<Tensor<float>(const nerf::Camera&, const watermark::Message&)> render;
  /// Returns the fraction of bits read correctly from an 8-bit image of any size.
  std::function<double(const Tensor<float>& image, const watermark::Message& sent)> accuracy;
};

/// Draws fair messages for views from a seed. Up to 4 bits, cycles through all messages, as in the paper.
watermark::Message message_of_view(Index bits, std::uint64_t seed, Index view);

/// Options for score_mark().
struct ScoreOptions {
  std::vector<nerf::Camera> cameras = {};  ///< of the views to read
  std::vector<std::string> under = {};     ///< names of parse_distortion()
  Index under_views = 0;  ///< how many views, from the first, are also read under distortions; 0: all
  /// Time limit in seconds: once it is over and `under_views` views are read, reading stops, because large
  /// networks take long per view. 0: reads all.
  double seconds = 0;
  const nerf::Dataset* ground_truth = nullptr;  ///< views to compare with; null: none
  std::uint64_t seed = 0;                       ///< seed of the distortions
  const Lpips<float>* lpips = nullptr;          ///< AlexNet; null: LPIPS values are NaN
  /// Called with the progress from 0 to 1; returning false stops the measurement, which throws Error.
  std::function<bool(double part)> progress = {};
};

/// How reliably a mark is read and how it changes images. Means without a finite value are NaN.
struct MarkScores {
  Index views = 0;                      ///< number of views read, see ScoreOptions::seconds
  double accuracy = 0;                  ///< fraction of bits correct in one view, mean over views
  double spread = 0;                    ///< standard deviation over views
  double psnr_base = 0;                 ///< against the unmarked render, dB, mean over views
  double psnr_base_foreground = 0;      ///< the same over pixels whose unmarked opacity exceeds 0.5
  double ssim_base = 0;                 ///< against the unmarked render
  double lpips_base = 0;                ///< against the unmarked render
  double psnr_gt = 0;                   ///< against ground_truth, dB, over the whole image
  double psnr_gt_object = 0;            ///< the same over the object's pixels
  double ssim_gt = 0;                   ///< against ground truth
  double lpips_gt = 0;                  ///< against ground truth
  double psnr_gt_unmarked = 0;          ///< of the unmarked field against ground truth
  std::map<std::string, double> under;  ///< accuracy under each distortion
};

/// Compares a marked scene with its unmarked field: reads bits and measures the difference from the unmarked
/// render on the given cameras, and from ground truth on the ground-truth cameras. Images are rounded to 8
/// bits.
/// @throws ValueError if there is no camera, or a distortion name is wrong
MarkScores score_mark(const nerf::RadianceField& unmarked, const MarkedScene& marked,
                      const ScoreOptions& options);

}  // namespace fieldmark::baselines
