#pragma once
#include <fieldmark/nerf/data_survey.h>

namespace fieldmark::nerf {

/// Finds the oddities of odd_views() that images show: blank_images, duplicates, exposures, few_views, masks,
/// sizes.
std::vector<Oddity> odd_images(std::span<const SurveyedView> views, SceneType scene);

/// Returns "1 image", "2 images".
std::string counted(Index count, const std::string& thing);

/// Returns the name of a view among several splits: "train/0012".
std::string full_name(const SurveyedView& view);

/// Returns true if two thumbnails are bit-identical and have more than one colour.
bool same_image(const SurveyedView& a, const SurveyedView& b);

/// Returns for each view the index of the view with the nearest camera, by distance and angle; its own index
/// if there is none within 0.2 radians and of another pose.
std::vector<std::size_t> neighbours(std::span<const SurveyedView> views);

}  // namespace fieldmark::nerf
