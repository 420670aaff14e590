#pragma once
#include <fieldmark/engine/tensor.h>

#include <span>

namespace fieldmark::results {

/// Two images of the same view.
struct ImagePair {
  Tensor<float> first, second;  ///< [H, W, 3]
};

/// Makes a contact sheet: one row per view with the first image, the second, and grey plus `gain` times their
/// difference, rounded to 8 bits like saved images.
/// @throws ShapeError if the images of a pair differ in shape   @throws ValueError if there is no pair
Tensor<float> comparison_sheet(std::span<const ImagePair> pairs, float gain = 10);

}  // namespace fieldmark::results
