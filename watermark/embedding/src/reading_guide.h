#pragma once
#include <fieldmark/watermark/embedding/embedder.h>

#include <array>
#include <memory>
#include <vector>

#include "distorted_views.h"

// Draws baking towards colours that the extractor reads better. Private.
namespace fieldmark::watermark {

// Reads its views one after another and keeps, for each, by how much its pixels should differ from the mark
// until the view's next turn.
class ReadingGuide {
 public:
  // Caches the views, half of them in every direction for an object. The owner must outlive the guide.
  // `strength` is eta below.
  ReadingGuide(const Owner& owner, const Message& message, Index views, double strength, std::uint64_t seed);

  // Returns the view of a turn.
  const CachedView& view(Index turn) const { return views_[at(turn % std::ssize(views_))]; }
  // Computes by how much the pixels of that view should differ from their target, [pixels, 3]:
  //   -eta rho (1 - flatness) max(-3, min(3, g / rms(g))) on the foreground, 0 elsewhere,   g = dL / dchange
  // with the reading loss L of the distorted view (MarkTraining::reading_loss()), the RMS rho of the change
  // that the mark asks for, and both RMS over the foreground. So the change grows where the extractor errs,
  // whatever the scale of L, and flat areas, where eyes would see it, stay as the mark left them.
  // `change` is what the pixels show so far, `asked` what they show of the mark, [pixels, 3] less the
  // unmarked.
  void read(Index turn, std::span<const float> change, std::span<const float> asked);

  struct Pixel {
    const nerf::Camera& camera;
    float place[2];                // x, y
    std::span<const float> shift;  // [3]
  };
  // Picks a pixel of the views that the first `turns` turns have read by three uniform numbers. turns >= 1.
  Pixel pick(std::span<const float, 3> u, Index turns) const;
  // Returns the shifts of all views, [views, pixels, 3], for checkpoints.
  std::span<float> shifts() { return shifts_; }

 private:
  const Owner& owner_;
  double strength_;
  std::vector<CachedView> views_;
  DistortedViews drawn_;
  std::unique_ptr<MarkTraining> training_;
  CellCode code_;
  Message message_;
  std::vector<std::int8_t> signs_;
  std::vector<float> shifts_;
  Tape<float> tape_;
};

}  // namespace fieldmark::watermark
