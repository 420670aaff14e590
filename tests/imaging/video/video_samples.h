#pragma once
#include <fieldmark/imaging/video/video_reader.h>
#include <fieldmark/imaging/video/video_writer.h>

#include <algorithm>
#include <cmath>

#include "imaging/media_samples.h"
#include "support/library.h"
#include "support/worst.h"

inline bool video_or_skip() {
  return library_or_skip(fieldmark::has_video(), "the test of videos",
                         "libavformat-dev, libavcodec-dev, libswscale-dev");
}

/// Returns eight frames of clip_frame() in MP4, one every 0.1 s.
inline std::vector<std::byte> small_mp4(int crf = 10) {
  fieldmark::VideoWriter writer(32, 16, {.crf = crf, .frames_per_second = 10});
  for (int k = 0; k < 8; ++k) writer.add(clip_frame(k));
  return writer.finish();
}

/// Returns the largest pixel difference in the middles of the parts, where chroma does not bleed.
inline double part_difference(const fieldmark::Tensor<float>& a, const fieldmark::Tensor<float>& b) {
  double most = 0;
  for (const int x : {4, 8, 12, 20, 24, 28})
    for (const int y : {2, 4, 11, 13})
      for (int c = 0; c < 3; ++c)
        raise_to(most, std::abs(static_cast<double>(a[(y * 32 + x) * 3 + c] - b[(y * 32 + x) * 3 + c])));
  return most;
}
