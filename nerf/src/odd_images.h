#pragma once
#include <fieldmark/nerf/data_survey.h>

namespace fieldmark::nerf {

/// The kinds of odd_views() that images tell: blank_images, duplicates, exposures, few_views, masks, sizes.
std::vector<Oddity> odd_images(std::span<const SurveyedView> views, SceneType scene);

/// "1 image", "2 images".
std::string counted(Index count, const std::string& thing);

/// The name of a view among those of several splits: "train/0012".
std::string full_name(const SurveyedView& view);

/// Whether two thumbnails have the same bits, and more than one colour.
bool same_image(const SurveyedView& a, const SurveyedView& b);

/// Of each view, the number of the one whose camera is next to its own, by distance and angle; its own number
/// where there is no other within 0.2 radians and of another pose.
std::vector<std::size_t> neighbours(std::span<const SurveyedView> views);

}  // namespace fieldmark::nerf
