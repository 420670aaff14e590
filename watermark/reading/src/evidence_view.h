#pragma once
#include <fieldmark/nerf/camera.h>
#include "jpeg_score.h"
#include "surround.h"

namespace fieldmark::watermark {

/// An image at the size at which evidence is taken, and what it has lost before.
struct EvidenceView {
  Surround seen;                    ///< the place of the cut is left out
  nerf::Camera camera;              ///< of its size
  std::optional<JpegTrace> jpeg{};  ///< the image's own compression
  bool small = false;               ///< true if the image has less than 0.6 of the training images' scale
};

/// Chooses the size: at most 512 pixels on the longer side, and so many that at most 48,000 of them show the
/// field. More took longer and read no more bits (docs/notes/reading.md). A compressed image keeps its size,
/// because resizing hides the steps of its coefficients.
/// @param camera  of the image's size   @param shown  share of the pixels that show the field, in [0, 1]
/// @param trained  of the field
EvidenceView evidence_view(const Surround& seen, const nerf::Camera& camera, double shown,
                           const nerf::CameraSpan& trained);

}  // namespace fieldmark::watermark
