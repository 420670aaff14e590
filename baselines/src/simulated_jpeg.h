#pragma once
#include <fieldmark/engine/tape.h>

namespace fieldmark::baselines {

/// The 8 x 8 frequencies that simulated_jpeg() keeps: those of the lowest rows and columns.
struct KeptFrequencies {
  Index luma = 5;    ///< rows and columns of luma, 0 to 8
  Index chroma = 3;  ///< rows and columns of both colour differences, 0 to 8
};

/// Simulates the loss of JPEG without its rounding: each 8 x 8 block loses its high frequencies, the colour
/// differences more of them.
///   y = C^-1 D^T M D C x,   C: RGB to YCbCr (without offsets), D: cosine transform of a block, M: 0 or 1
/// Source: Jia et al. 2021 (MBRS), section 3.3; Zhu et al. 2018 (HiDDeN), section 3.1 (JPEG-Mask). Constant
/// images are unchanged if frequency 0 is kept; keeping all is the identity.
/// @param x [N, H, W, 3], H and W multiples of 8   @return [N, H, W, 3]
/// @throws ShapeError if x is not   @throws ValueError if a number of frequencies is out of range
/// Differentiable in: x.
template <class T>
Var<T> simulated_jpeg(Var<T> x, KeptFrequencies kept = {});

}  // namespace fieldmark::baselines
