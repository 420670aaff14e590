#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/data_report.h>

namespace fieldmark::nerf {

/// Draws the cameras of a data set from above, with the mean viewing direction upwards, and next to that, at
/// the same scale, from the right, with that direction to the right.
/// Each camera is a pyramid from its position to its image, in the colour of its split; outlying ones are red
/// and labelled, or a disc on the edge if they lie beyond it. A cross marks the point that the cameras look
/// at.
/// @param report  with at least one camera   @return [700, 1240, 3]   @throws ValueError without cameras
Tensor<float> camera_chart(const DataReport& report);

}  // namespace fieldmark::nerf
