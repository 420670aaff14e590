#include "reading_guide.h"

#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/flatness.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr float kLargestPush = 3;  // times the RMS of the gradient

// Returns the RMS over the foreground of [pixels, 3].
float rms(std::span<const float> x, const std::vector<float>& foreground) {
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const auto weight = static_cast<double>(foreground[i / 3]), value = static_cast<double>(x[i]);
    squares += weight * value * value;
    count += weight;
  }
  return count > 0 ? static_cast<float>(std::sqrt(squares / count)) : 0;
}

}  // namespace

ReadingGuide::ReadingGuide(const Owner& owner, const Message& message, Index views, double strength,
                           std::uint64_t seed)
    : owner_(owner),
      strength_(strength),
      views_(cache_embed_views(owner.field, owner.options().patch(), {.count = views}, seed)),
      drawn_(owner, views_, {}, 1, seed),
      training_(owner.mark().training(owner, views_)),
      code_(owner.code()),
      message_(message),
      signs_(cell_signs(code_, message)) {}

const CachedView& ReadingGuide::view(Index step) const { return views_[at(drawn_.view(step, 0))]; }

void ReadingGuide::shifts(Index step, std::span<const float> change, std::span<const float> asked,
                          std::vector<float>& shift) {
  tape_.reset();
  TrainingImage image = drawn_.draw(step, 0, tape_);
  image.code = code_;
  image.message = message_;
  image.signs = signs_;
  const CachedView& view = views_[at(image.view)];
  std::vector<float> marked(change.begin(), change.end());
  for (std::size_t i = 0; i < marked.size(); ++i)
    marked[i] = std::clamp(marked[i] + view.base.data[i], 0.f, 1.f);
  const Var<float> leaf = tape_.fresh_leaf(marked.data(), nullptr, {view.height * view.width, 3});
  TrainingFigures unused;
  tape_.backward(training_->reading_loss(Params<float>(owner_.params, nullptr), leaf, image, unused));

  const std::span<const float> gradient(leaf.grad(), marked.size());
  const std::vector<float> foreground = foreground_mask(view);
  const float of_gradient = rms(gradient, foreground),
              push = static_cast<float>(strength_) * rms(asked, foreground);
  shift.assign(marked.size(), 0.f);
  if (of_gradient == 0) return;
  const std::vector<float> flat = flatness(view, foreground);
  for (std::size_t i = 0; i < shift.size(); ++i)
    if (foreground[i / 3] > 0)
      shift[i] = -push * (1 - flat[i]) * std::clamp(gradient[i] / of_gradient, -kLargestPush, kLargestPush);
}

}  // namespace fieldmark::watermark
