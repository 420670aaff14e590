#pragma once
#include <fieldmark/nerf/camera.h>
#include "jpeg_planes.h"
#include "surround.h"

#include <optional>

namespace fieldmark::watermark {

/// An image at the size at which evidence is taken, and what it has lost before.
struct EvidenceView {
  Surround seen;                    ///< of this size; left and top are 0
  nerf::Camera camera;              ///< of this size
  std::optional<JpegTrace> jpeg{};  ///< the image's own compression
  double zoom = 1;                  ///< pixels of the image, at 512 at most, in one of this size
  bool small = false;  ///< true if the image, at 512 pixels at most, has less than 0.6 of the training
                       ///< images' scale
};

/// Reduces an image to 512 pixels on the longer side, and to about 48,000 pixels that show the field: 64,000
/// read as many bits as all (docs/notes/reading.md). A compressed image of at most 512 pixels keeps its size,
/// because resizing hides the steps of its coefficients. Larger ones do not count as compressed.
/// @param camera  of the image's size   @param shown  share of the pixels that show the field, in [0, 1]
/// @param trained  of the field
EvidenceView evidence_view(const Surround& seen, const nerf::Camera& camera, double shown,
                           const nerf::CameraSpan& trained);

}  // namespace fieldmark::watermark
