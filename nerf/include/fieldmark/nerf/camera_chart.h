#pragma once
#include <fieldmark/engine/tensor.h>
#include <fieldmark/nerf/data_report.h>

namespace fieldmark::nerf {

/// An image of the cameras of a data set: seen from above with the mean viewing direction upwards, and beside
/// it, at the same scale, from the right, with that direction to the right.
/// Each camera is a pyramid from its position to its image, in the colour of its split; outlying ones are red
/// and named, beyond the edge as a disc on it. A cross marks the point they look at.
/// @param report  with at least one camera   @return [700, 1240, 3]   @throws ValueError without cameras
Tensor<float> camera_chart(const DataReport& report);

}  // namespace fieldmark::nerf
