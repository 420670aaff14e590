#include "cell_strength.h"

#include <fieldmark/engine/random.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/resize.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <algorithm>
#include <cmath>
#include <numeric>

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
  // Returns the view with a mark of these signs, in 8 bits and enlarged as for reading, and adds the changes
  // of its pixels to their cells.
  Tensor<float> marked(const std::vector<std::int8_t>& signs) {
    std::vector<float> rgb = view_.colour, blended(view_.weight.size());
    owner_.cells.blend(signs, view_.position.data(), std::ssize(blended), blended.data());
    owner_.marking(signs)(view_.position.data(), view_.direction.data(), std::ssize(view_.weight),
                          rgb.data());
    Tensor<float> image = view_.base;
    for (Index p = 0; p < view_.height * view_.width; ++p) {
      const auto first = at(view_.sample_begin[at(p)]), last = at(view_.sample_begin[at(p + 1)]);
      double changed = 0;
      for (std::size_t a = 0; a < 3; ++a) {
        float change = 0;
        for (std::size_t k = first; k < last; ++k)
          change += view_.weight[k] * (rgb[3 * k + a] - view_.colour[3 * k + a]);
        image[3 * p + static_cast<Index>(a)] =
            std::clamp(image[3 * p + static_cast<Index>(a)] + change, 0.f, 1.f);
        changed += std::abs(static_cast<double>(change));
      }
      const std::int32_t cell =
          foreground_[at(p)] > 0 ? owner_.cells.at(&view_.position[3 * first]) : std::int32_t{-1};
      if (cell >= 0) change_[at(cell)] += changed * signs[at(cell)] * (blended[first] < 0 ? -1 : 1);
    }
    const PatchSize patch = owner_.options().patch();
    image = quantize8(image);
    return image.shape[0] == patch.height && image.shape[1] == patch.width
               ? image
               : resize_bilinear(image, patch.height, patch.width);
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
