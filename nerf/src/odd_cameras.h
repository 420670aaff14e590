#pragma once
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/data_survey.h>

#include <optional>

namespace fieldmark::nerf {

/// Finds the oddities of odd_views() that cameras show: cameras_look_away, equal_poses, focal_lengths,
/// one_place, outlying_cameras, principal_points.
std::vector<Oddity> odd_cameras(std::span<const SurveyedView> views, SceneType scene);

/// Returns the distances of positions from their coordinate-wise median.
std::vector<double> distances_from_middle(std::span<const SurveyedView> views);

/// Marks the outlying cameras, see odd_views(); none if there are fewer than five.
std::vector<bool> outlying(std::span<const SurveyedView> views);

/// Returns the span of the cameras that are not outlying; none if they are all at the point they look at.
std::optional<CameraSpan> span_without(std::span<const SurveyedView> views, const std::vector<bool>& far);

}  // namespace fieldmark::nerf
