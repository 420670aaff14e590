#pragma once
#include <fieldmark/nerf/trainer.h>

#include <algorithm>

#include "hierarchical_sampler.h"

namespace fieldmark::nerf {

// What the chunks of a shard use in turn, and what their samples pass back to the table.
struct Trainer::Shard {
  // Grows to twice the needed size, so that steps with slightly more samples than any before do not allocate.
  struct Buffer {
    std::vector<float> numbers;
    std::size_t used = 0;
    float* append(Index n) {
      const std::size_t begin = used;
      used += static_cast<std::size_t>(n);
      if (numbers.size() < used) numbers.resize(2 * used);
      return numbers.data() + begin;
    }
  };
  CubeRays rays;                                 // of a chunk
  std::vector<float> jitter, truth, background;  // the same
  RaySampler sampler;
  RaySamples found;
  // For mlp fields only.
  HierarchicalSampler hierarchical;
  RaySamples first;
  std::vector<float> weights;
  // All chunks of a step in order; within a chunk, feature gradients are stored level by level.
  std::vector<Index> samples;
  Buffer position, dfeatures;
  std::vector<Index> places;                    // of the pixels of a chunk's rays in all images
  std::vector<Index> images;                    // that hold these pixels
  std::vector<float> dposition;                 // of a chunk's samples, if cameras are refined
  std::vector<float> image_grads;               // of all chunks, laid out as ImageCorrections::params
  std::vector<std::pair<Index, float>> errors;  // of the rays of all chunks: tile and mean square

  void begin_step() {
    samples.clear();
    errors.clear();
    std::fill(image_grads.begin(), image_grads.end(), 0.f);
    position.used = dfeatures.used = 0;
  }
};

}  // namespace fieldmark::nerf
