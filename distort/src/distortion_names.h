#pragma once
#include "fieldmark/distort/distortion.h"

namespace fieldmark::distort {

/// Rejects clip distortions. @throws ValueError if the distortion needs a clip
void refuse_clip(const Distortion& distortion);

}  // namespace fieldmark::distort
