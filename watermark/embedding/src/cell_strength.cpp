#include "cell_strength.h"

#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/mark/object_window.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "ray_change.h"

namespace fieldmark::watermark {
namespace {

constexpr std::uint64_t kCodes = 8;  // per view: a cell's evidence also depends on the signs around it
constexpr double kScale = 1 << 19;

class Shown {
 public:
  Shown(const Owner& owner, const CachedView& view)
      : owner_(owner),
        view_(view),
        foreground_(foreground_mask(view)),
        evidence_(at(owner.cells.count())),
        change_(evidence_.size()) {}

  void add(const std::vector<std::int8_t>& signs) {
    const std::vector<double> read = owner_.mark().evidence(owner_, marked(signs), nullptr);
    for (std::size_t c = 0; c < read.size(); ++c) evidence_[c] += signs[c] * read[c];
  }
  // Appends the strength of each cell.
  void append_to(std::vector<std::int32_t>& strength) const {
    std::vector<double> read, changed;
    for (const double e : evidence_) read.push_back(std::max(0.0, e));
    for (const double d : change_) changed.push_back(std::sqrt(std::max(0.0, d)));
    const auto sum = [](const std::vector<double>& x) {
      return std::max(std::accumulate(x.begin(), x.end(), 0.0), 1e-300);
    };
    const double of_read = kScale / sum(read), of_changed = kScale / sum(changed);
    for (std::size_t c = 0; c < read.size(); ++c)
      strength.push_back(static_cast<std::int32_t>(std::lround(of_read * read[c] + of_changed * changed[c])));
  }

 private:
  // Returns the view with a mark of these signs as it is read, in 8 bits, and adds the changes of its pixels
  // to their cells.
  Tensor<float> marked(const std::vector<std::int8_t>& signs) {
    std::vector<float> rgb = view_.colour, blended(view_.weight.size()), change(view_.base.data.size());
    const auto* x = view_.position.data();
    owner_.cells.blend(signs, x, std::ssize(blended), blended.data());
    owner_.marking(signs)(x, view_.direction.data(), std::ssize(blended), rgb.data());
    change_on_rays(view_.sample_begin, view_.weight, rgb.data(), view_.colour.data(), change.data());
    Tensor<float> image = view_.base;
    for (std::size_t i = 0; i < change.size(); ++i)
      image.data[i] = std::clamp(image.data[i] + change[i], 0.f, 1.f);
    for (std::size_t p = 0; p < foreground_.size(); ++p) {
      if (foreground_[p] == 0) continue;
      const auto first = at(view_.sample_begin[p]);
      const std::int32_t cell = owner_.cells.at(x + 3 * first);
      if (cell < 0) continue;
      const int agrees = (blended[first] < 0 ? -1 : 1) * signs[at(cell)];
      for (std::size_t i = 3 * p; i < 3 * p + 3; ++i)
        change_[at(cell)] += agrees * std::abs(static_cast<double>(change[i]));
    }
    const Window whole{0, 0, static_cast<double>(view_.width), static_cast<double>(view_.height)};
    return cut_window(quantize8(image), whole, owner_.options().patch(),
                      nerf::background_value(owner_.field.background));
  }

  const Owner& owner_;
  const CachedView& view_;
  std::vector<float> foreground_;
  std::vector<double> evidence_, change_;  // of each cell, sums over the codes
};

}  // namespace

std::vector<std::int32_t> cell_strength(const Owner& owner, std::span<const CachedView> views,
                                        std::uint64_t seed) {
  // Drawn, because views of a kind may come at regular distances; in order, which costs nothing.
  const Index all = std::ssize(views), used = std::min(all, kStrengthViews);
  std::vector<Index> drawn = permutation(all, CounterRng(seed, 1), 0);
  drawn.resize(at(used));
  std::ranges::sort(drawn);
  std::vector<std::int32_t> strength;
  std::vector<std::int8_t> signs(at(owner.cells.count()));
  const Key root = key_of_seed(seed);
  for (Index v = 0; v < used; ++v) {
    Shown shown(owner, views[at(drawn[at(v)])]);
    for (std::uint64_t code = 0; code < kCodes; ++code) {
      keyed_signs(derive_key(root, "fieldmark cell strength", static_cast<std::uint64_t>(v) * kCodes + code),
                  "fieldmark cell sign", signs);
      shown.add(signs);
    }
    shown.append_to(strength);
  }
  return strength;
}

}  // namespace fieldmark::watermark
