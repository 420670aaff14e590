#pragma once
#include "pose_alignment.h"

#include <functional>
#include <vector>

namespace fieldmark::watermark {

/// Chooses among coarse alignments by aligning the best of them finely. Until both are fine, a wrong camera
/// may agree slightly more than the right one.
/// Candidates with at most 0.05 less agreement than the best coarse one are aligned in the order of their
/// agreement, at most four of them, until one reaches `enough`. A camera that shows the scene within 2% of
/// the image as one aligned before is left out.
/// @param fine  aligns a camera finely   @param points  of the scene, world, that tell cameras apart
/// @return the fine alignment that agrees most; agreement -1 if there is none
Alignment best_alignment(std::vector<Alignment> coarse, double enough, const std::vector<nerf::Vec3>& points,
                         const std::function<Alignment(const nerf::Camera&)>& fine);

}  // namespace fieldmark::watermark
