#pragma once
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace fieldmark::nerf {

/// A view reduced to the features that reveal odd views.
struct SurveyedView {
  std::string name;              ///< as View::name
  std::string split;             ///< as Dataset::split
  Camera camera;                 ///< as View::camera, of the image without padding
  Index width = 0;               ///< of the image file, else of the image, pixels
  Index height = 0;              ///< of the image file, else of the image, pixels
  double valid = 1;              ///< share of the image's pixels that are valid
  std::vector<float> thumbnail;  ///< [32, 32, 4] means of premultiplied colour and of alpha over equal parts
};

/// An oddity of a data set that does not prevent loading it.
struct Oddity {
  /// blank_images, cameras_look_away, cameras_without_image, duplicates, equal_poses, exposures, few_views,
  /// focal_lengths, images_without_camera, masks, one_place, outlying_cameras, principal_points, sizes,
  /// twins.
  std::string kind;
  Index count = 0;                      ///< number of odd images or cameras
  std::string text{};                   ///< human-readable: a sentence with the count and no full stop
  std::string remedy{};                 ///< human-readable: what to do, likewise without a full stop
  std::vector<std::string> images{};    ///< names of the odd images, or of the images of odd cameras
  std::vector<std::string> partners{};  ///< of duplicates, equal_poses, exposures, twins: the counterparts
};

/// Reduces the views of a split, in one pass over their pixels.
std::vector<SurveyedView> survey_views(const Dataset& data);

/// Finds oddities in views of one scene, from one split or several. Equal images and few views are reported
/// for split train only.
///   - duplicates: bit-identical thumbnails.
///   - blank_images: thumbnails of one colour to within 1/255.
///   - exposures: brighter, or darker, by 15% (for an object 25%) at each quartile of the thumbnail's
///     luminance than the image of the nearest camera within 0.2 radians and of another pose.
///   - masks: less than a tenth of the pixels are valid.
///   - outlying_cameras: farther from the median position than 5/2 of the 90th percentile of distances, and
///     than four times this percentile minus three times the median distance.
///   - cameras_look_away: the point nearest to all viewing axes is outside the cone about the camera's axis
///     that holds the image; in a place, only if it is behind 95% of the cameras; never in a forward-facing
///     scene.
///   - focal_lengths: a horizontal field of view outside 2 to 150 degrees.
///   - principal_points: outside the image, or within a 16th of its sides from the upper left corner.
///   - few_views: fewer than 12 training views; in a forward-facing scene fewer than 6.
std::vector<Oddity> odd_views(std::span<const SurveyedView> views, SceneType scene);

/// Finds held-out views that repeat a training view: with the same thumbnail, or with nearly the same
/// thumbnail and camera. Returns at most one oddity, of kind twins.
std::vector<Oddity> twins(std::span<const SurveyedView> train, std::span<const SurveyedView> held_out);

/// Finds cameras whose image is missing, and image files next to the others that no camera of any split uses.
/// Files whose name extends that of a used image (r_0_depth.png) are not odd.
/// @param size  as DatasetOptions::size   @throws IoError as load_dataset()
std::vector<Oddity> odd_files(const std::filesystem::path& folder, Index size);

}  // namespace fieldmark::nerf
