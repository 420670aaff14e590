#pragma once
// What the parts of CameraSearch share. Private.
#include <fieldmark/watermark/reading/camera_search.h>

#include <cmath>
#include <complex>

namespace fieldmark::watermark {

using Complex = std::complex<double>;

struct CameraSearch::Match {
  std::int32_t cell;
  Complex place;  // pixels of the image
  double share;
};

// A small view's pixel u goes to a u + b in the image.
struct CameraSearch::Proposal {
  std::size_t view = 0;
  Complex a{1, 0}, b{};
  double score = -1;
};

// Takes the mean away and makes the length 1; all 0 where there is nothing but the mean.
inline void make_unit(std::span<float> v) {
  double mean = 0, square = 0;
  for (const float x : v) mean += static_cast<double>(x) / static_cast<double>(v.size());
  for (const float x : v) square += std::pow(static_cast<double>(x) - mean, 2);
  const double scale = square > 0 ? 1 / std::sqrt(square) : 0;
  for (float& x : v) x = static_cast<float>((static_cast<double>(x) - mean) * scale);
}

}  // namespace fieldmark::watermark
