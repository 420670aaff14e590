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
      signs_(cell_signs(code_, message)),
      // All views have the size of the patch.
      shifts_(at(3 * std::ssize(views_) * views_.front().height * views_.front().width)) {}

void ReadingGuide::read(Index turn, std::span<const float> change, std::span<const float> asked) {
  tape_.reset();
  const Index index = turn % std::ssize(views_);
  TrainingImage image = drawn_.draw_of(index, turn, 0, tape_);
  image.code = code_;
  image.message = message_;
  image.signs = signs_;
  const CachedView& view = views_[at(index)];
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
  const std::span<float> shift = std::span(shifts_).subspan(at(index) * marked.size(), marked.size());
  std::ranges::fill(shift, 0.f);
  if (of_gradient == 0) return;
  const std::vector<float> flat = flatness(view, foreground);
  for (std::size_t i = 0; i < shift.size(); ++i)
    if (foreground[i / 3] > 0)
      shift[i] = -push * (1 - flat[i]) * std::clamp(gradient[i] / of_gradient, -kLargestPush, kLargestPush);
}

ReadingGuide::Pixel ReadingGuide::pick(std::span<const float, 3> u, Index turns) const {
  const auto below = [](float x, Index n) {
    return std::min(static_cast<Index>(x * static_cast<float>(n)), n - 1);
  };
  const Index index = below(u[0], std::min(turns, std::ssize(views_)));
  const CachedView& view = views_[at(index)];
  const Index x = below(u[1], view.width), y = below(u[2], view.height);
  return {.camera = view.camera,
          .place = {static_cast<float>(x), static_cast<float>(y)},
          .shift = std::span(shifts_).subspan(at(3 * ((index * view.height + y) * view.width + x)), 3)};
}

}  // namespace fieldmark::watermark
