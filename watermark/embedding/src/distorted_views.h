#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/watermark/embedding/embedder.h>

// Draws training images of cached views. Private.
namespace fieldmark::watermark {

class DistortedViews {
 public:
  // Owner and views must outlive the object. `batch` images a step have their own random numbers.
  DistortedViews(const Owner& owner, std::span<const CachedView> views, const EmbedDistortions& distortions,
                 Index batch, std::uint64_t seed);
  // Draws view, sample positions and distortions of an image; code, message and signs stay empty.
  TrainingImage draw(Index step, Index image, Tape<float>& tape) const;
  // Draws the same for an image of a given view.
  TrainingImage draw_of(Index view, Index step, Index image, Tape<float>& tape) const;
  // Index of an image in the run.
  std::uint64_t place(Index step, Index image) const {
    return static_cast<std::uint64_t>(step * batch_ + image);
  }

 private:
  float* shifted_positions(Tape<float>& tape, Index view, std::uint64_t place) const;
  Var<float> distorted(Var<float> image, std::uint64_t place, bool warped, const std::array<float, 6>& warp,
                       float blur, float noise) const;

  const Owner& owner_;
  std::span<const CachedView> views_;
  EmbedDistortions distortions_;
  Index batch_;
  CounterRng choice_rng_, noise_rng_, shift_rng_;
};

}  // namespace fieldmark::watermark
