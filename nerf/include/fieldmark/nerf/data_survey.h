#pragma once
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// A view reduced to what tells an odd one from the others.
struct SurveyedView {
  std::string name;              ///< as View::name
  std::string split;             ///< as Dataset::split
  Camera camera;                 ///< as View::camera, of the image without what fills it up
  Index width = 0;               ///< of the image file, else of the image, pixels
  Index height = 0;              ///< of the image file, else of the image, pixels
  double valid = 1;              ///< share of the image's pixels that are learnt and counted
  std::vector<float> thumbnail;  ///< [32, 32, 4] means of premultiplied colour and of alpha over equal parts
};

/// Something odd about a data set that loads nevertheless.
struct Oddity {
  /// blank_images, cameras_look_away, cameras_without_image, duplicates, equal_poses, exposures, few_views,
  /// focal_lengths, images_without_camera, masks, one_place, outlying_cameras, principal_points, sizes,
  /// twins.
  std::string kind;
  Index count = 0;                      ///< of images or cameras that are odd
  std::string text{};                   ///< for people: a sentence without a full stop that names the count
  std::string remedy{};                 ///< for people: the same
  std::vector<std::string> images{};    ///< names of these images, and of those of these cameras
  std::vector<std::string> partners{};  ///< of duplicates, equal_poses, exposures, twins: each one's other
};

/// Reduces the views of a split: a pass over their pixels.
std::vector<SurveyedView> survey_views(const Dataset& data);

/// What is odd about views of the same scene, of one split or of several. Of equal images and of few views
/// the split train alone is told.
///   - duplicates: thumbnails with the same bits.
///   - blank_images: thumbnails of one colour to 1/255.
///   - exposures: at each quartile of the thumbnail's luminance 15% (of an object 25%) brighter, or darker,
///     than the image of the next camera, within 0.2 radians and of another pose.
///   - masks: less than a tenth of the pixels is valid.
///   - outlying_cameras: further from the median position than 5/2 of the distance that 9 in 10 keep, and
///     than four times it less three times the median distance.
///   - cameras_look_away: the point next to all viewing axes is not in the image; in a place, if it is
///     behind 95 of 100 cameras; not in a forward-facing scene.
///   - focal_lengths: a horizontal field of view outside 2 to 150 degrees.
///   - principal_points: outside the image, or within a 16th of its sides from the upper left corner.
///   - few_views: less than 12 to train on; of a forward-facing scene less than 6.
std::vector<Oddity> odd_views(std::span<const SurveyedView> views, SceneType scene);

/// The held-out views that a training view shows too: those with the same thumbnail, and those with nearly
/// the same of nearly the same camera. At most one oddity, of kind twins.
std::vector<Oddity> twins(std::span<const SurveyedView> train, std::span<const SurveyedView> held_out);

/// Cameras whose image is missing, and image files beside the others that no camera of any split has: for
/// those of the name of a used image with more behind it (r_0_depth.png) this is no oddity.
/// @param size  as DatasetOptions::size   @throws IoError as load_dataset()
std::vector<Oddity> odd_files(const std::filesystem::path& folder, Index size);

}  // namespace fieldmark::nerf
