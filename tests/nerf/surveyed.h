#pragma once
// Views as survey_views() returns them, but without images, for the tests of oddities.
#include <fieldmark/nerf/data_survey.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/random.h"

/// Returns a training view of a random opaque image of 40 x 30 pixels.
inline fieldmark::nerf::SurveyedView surveyed(const fieldmark::nerf::Pose& pose, int number) {
  fieldmark::nerf::SurveyedView view{.name = std::to_string(number),
                                     .split = "train",
                                     .camera = fieldmark::nerf::make_camera(pose, 0.7, 40, 30),
                                     .width = 40,
                                     .height = 30,
                                     .thumbnail = {}};
  const auto colours = uniform<float>({32, 32, 4}, 0.2, 0.8, static_cast<unsigned>(number + 1));
  view.thumbnail.assign(colours.data.begin(), colours.data.end());
  for (std::size_t i = 3; i < view.thumbnail.size(); i += 4) view.thumbnail[i] = 1;
  return view;
}

/// Returns views of cameras around the origin that look at it from a distance of about 4.5.
inline std::vector<fieldmark::nerf::SurveyedView> ring_of_views(int count) {
  std::vector<fieldmark::nerf::SurveyedView> views;
  for (int i = 0; i < count; ++i) {
    const double angle = 6.283185307179586 * i / count;
    views.push_back(surveyed(
        fieldmark::nerf::look_at({4 * std::cos(angle), 4 * std::sin(angle), 2}, {0, 0, 0}, {0, 0, 1}), i));
  }
  return views;
}

/// Returns the only oddity found; fails if there is none, more than one or one of another kind.
inline fieldmark::nerf::Oddity only(const std::vector<fieldmark::nerf::Oddity>& found,
                                    const std::string& kind) {
  INFO(kind);
  for (const auto& o : found) UNSCOPED_INFO(o.kind + ": " + o.text);
  REQUIRE(found.size() == 1);
  CHECK(found[0].kind == kind);
  CHECK(!found[0].remedy.empty());
  return found[0];
}
