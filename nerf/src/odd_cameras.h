#pragma once
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/data_survey.h>

#include <optional>

namespace fieldmark::nerf {

/// The kinds of odd_views() that cameras tell: cameras_look_away, equal_poses, focal_lengths, one_place,
/// outlying_cameras, principal_points.
std::vector<Oddity> odd_cameras(std::span<const SurveyedView> views, SceneType scene);

/// Distances of positions from the median one, coordinate by coordinate.
std::vector<double> distances_from_middle(std::span<const SurveyedView> views);

/// Whether each camera is outlying, see odd_views(); none of less than five is.
std::vector<bool> outlying(std::span<const SurveyedView> views);

/// The span of the cameras that are not outlying; none where they all stand at the point they look at.
std::optional<CameraSpan> span_without(std::span<const SurveyedView> views, const std::vector<bool>& far);

}  // namespace fieldmark::nerf
