#pragma once
#include <fieldmark/watermark/embedding/embedder.h>

#include <memory>
#include <vector>

#include "distorted_views.h"

// Draws baking towards colours that the extractor reads better. Private.
namespace fieldmark::watermark {

class ReadingGuide {
 public:
  // Caches the views, half of them in every direction for an object. The owner must outlive the guide.
  // `strength` is eta below.
  ReadingGuide(const Owner& owner, const Message& message, Index views, double strength, std::uint64_t seed);

  // Returns the view whose reading guides a step.
  const CachedView& view(Index step) const;
  // Computes by how much the rays of that view should differ from their target, [pixels, 3]:
  //   -eta rho (1 - flatness) max(-3, min(3, g / rms(g))) on the foreground, 0 elsewhere,   g = dL / dchange
  // with the reading loss L of the distorted view (MarkTraining::reading_loss()), the RMS rho of the change
  // that the mark asks for, and both RMS over the foreground. So the change grows where the extractor errs,
  // whatever the scale of L, and flat areas, where eyes would see it, stay as the mark left them.
  // `change` is what the rays show so far, `asked` what they show of the mark, [pixels, 3] less the unmarked.
  void shifts(Index step, std::span<const float> change, std::span<const float> asked,
              std::vector<float>& shift);

 private:
  const Owner& owner_;
  double strength_;
  std::vector<CachedView> views_;
  DistortedViews drawn_;
  std::unique_ptr<MarkTraining> training_;
  CellCode code_;
  Message message_;
  std::vector<std::int8_t> signs_;
  Tape<float> tape_;
};

}  // namespace fieldmark::watermark
