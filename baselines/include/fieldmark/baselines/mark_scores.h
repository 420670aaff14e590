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

/// A marked scene as its measurement sees it, whatever system made it.
struct MarkedScene {
  Index bits = 16;  ///< length of a message
  /// The message of a view; scenes that carry a fixed one, or two, give those.
  std::function<watermark::Message(Index view)> message;
  /// An image [H, W, 3] of the scene with the message.
  std::function<Tensor<float>(const nerf::Camera&, const watermark::Message&)> render;
  /// Share of bits that are read right from an image of any size, 8 bits a number.
  std::function<double(const Tensor<float>& image, const watermark::Message& sent)> accuracy;
};

/// Fair messages for views, from a seed; up to 4 bits all messages in turns, as the paper has it.
watermark::Message message_of_view(Index bits, std::uint64_t seed, Index view);

/// What score_mark() looks at.
struct ScoreOptions {
  std::vector<nerf::Camera> cameras = {};  ///< of the views that are read
  std::vector<std::string> under = {};     ///< names of parse_distortion()
  Index under_views = 0;  ///< the first so many views are also read under distortions; 0: all
  /// After so many seconds, and `under_views` views, no further view is read: large networks take long for
  /// each. 0: all are read.
  double seconds = 0;
  const nerf::Dataset* ground_truth = nullptr;  ///< whose views are compared with; null: none
  std::uint64_t seed = 0;                       ///< of the distortions
  const Lpips<float>* lpips = nullptr;          ///< AlexNet; null: lpips are NaN
  /// Told how far it is, from 0 to 1; false stops it, which throws Error.
  std::function<bool(double part)> progress = {};
};

/// How well a mark is read and what it does to images; a mean without a finite number is NaN.
struct MarkScores {
  Index views = 0;                      ///< that were read, see ScoreOptions::seconds
  double accuracy = 0;                  ///< share of bits right in one view, mean over views
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

/// Measures a marked scene beside its unmarked field: bits and the difference to the unmarked render on the
/// given cameras, the difference to ground truth on the ground truth' cameras. Images are rounded to 8 bits.
/// @throws ValueError if there is no camera, or the name of a distortion is wrong
MarkScores score_mark(const nerf::RadianceField& unmarked, const MarkedScene& marked,
                      const ScoreOptions& options);

}  // namespace fieldmark::baselines
