#pragma once
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <string>
#include <vector>

namespace fieldmark::bench {

/// Errors added to the poses of training cameras.
struct PoseJitter {
  double degrees = 0.5;  ///< of the rotation about a random axis, >= 0
  double part = 0.01;    ///< length of the random move, in distances to the scene, >= 0
  std::uint64_t seed = 0;
};

/// Rotates and moves every camera, each by the full amount in a random direction. The distance to the scene
/// is the harmonic mean of the bounds in View::depth where there is one, else that to `centre`.
void jitter_cameras(nerf::Dataset& data, const PoseJitter& jitter, const nerf::Vec3& centre);

/// Settings of a training: per-image parameters and initial poses.
struct CaptureVariant {
  std::string name;  ///< "jittered, poses refined"
  bool exposures = false, refined = false, jittered = false;
};

/// Returns: as captured; exposures; refined; exposures and refined; jittered; jittered and refined.
std::vector<CaptureVariant> capture_variants();

/// Result of a training on the test images.
struct CaptureRow {
  CaptureVariant variant;
  Index steps = 0;
  double psnr = 0;                ///< of the test images as they are, dB
  double psnr_colour_fitted = 0;  ///< after an affine map of each render's colours to its image, dB
  double psnr_pose_fitted = 0;    ///< after fit_cameras() of the test images, dB
};

/// Options of run_captures_bench().
struct CaptureRun {
  double seconds = 60;     ///< of each training
  std::uint64_t seed = 0;  ///< of fields, trainings and fits
  Index fit_steps = 300;   ///< of fitting the cameras of the test images
};

/// Trains a field with each variant, one after the other, of the size that `train` gives a run of this
/// length. Nothing is carved, because refined poses exclude it.
/// @param progress  called with the name and the share done of all; may throw to stop
std::vector<CaptureRow> run_captures_bench(const nerf::Dataset& train, const nerf::Dataset& test,
                                           const CaptureRun& run, const PoseJitter& jitter,
                                           const std::function<void(const std::string&, double)>& progress);

/// Returns the dB that jitter lost. @param psnr  the PSNR that counts
double lost(const std::vector<CaptureRow>& rows, double CaptureRow::*psnr);
/// Returns the share of the lost dB that refined poses brought back, 1 if all; NaN if nothing was lost.
double recovered(const std::vector<CaptureRow>& rows, double CaptureRow::*psnr);

}  // namespace fieldmark::bench
