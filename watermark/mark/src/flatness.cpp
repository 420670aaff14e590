#include <fieldmark/watermark/mark/flatness.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {

std::vector<float> flatness(const CachedView& v, const std::vector<float>& foreground) {
  std::vector<float> flat(3 * foreground.size(), 0.f);
  for (Index y = 0; y < v.height; ++y)
    for (Index x = 0; x < v.width; ++x) {
      const Index p = y * v.width + x;
      if (foreground[at(p)] == 0) continue;
      float sum = 0, squares = 0, n = 0;
      for (Index j = std::max<Index>(y - 2, 0); j <= std::min(y + 2, v.height - 1); ++j)
        for (Index i = std::max<Index>(x - 2, 0); i <= std::min(x + 2, v.width - 1); ++i) {
          const float g = v.base[3 * (j * v.width + i) + 1];
          sum += g;
          squares += g * g;
          n += 1;
        }
      const float variance = std::max(squares / n - (sum / n) * (sum / n), 0.f);
      std::fill_n(&flat[at(3 * p)], 3, std::exp(-variance / (0.03f * 0.03f)));
    }
  return flat;
}

double flat_share(std::span<const CachedView> views) {
  double flat = 0, shown = 0;
  for (const CachedView& v : views) {
    const std::vector<float> foreground = foreground_mask(v), here = flatness(v, foreground);
    for (std::size_t p = 0; p < foreground.size(); ++p) {
      flat += static_cast<double>(here[3 * p]);
      shown += static_cast<double>(foreground[p]);
    }
  }
  return shown > 0 ? flat / shown : 0;
}

}  // namespace fieldmark::watermark
