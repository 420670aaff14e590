#pragma once
#include <fieldmark/engine/tensor.h>

#include <span>

namespace fieldmark::cli {

/// Two pictures of one view.
struct PicturePair {
  Tensor<float> first, second;  ///< [H, W, 3]
};

/// For looking at a mark: a row for each view with the first picture, the second, and grey plus `gain` times
/// their difference, all rounded to 8 bits as saved pictures are.
/// @throws ShapeError if the pictures of a pair differ in shape   @throws ValueError if there is no pair
Tensor<float> comparison_sheet(std::span<const PicturePair> pairs, float gain = 10);

}  // namespace fieldmark::cli
