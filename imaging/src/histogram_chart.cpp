#include <fieldmark/core/error.h>
#include <fieldmark/imaging/histogram_chart.h>

#include <algorithm>
#include <cmath>

#include "svg.h"

namespace fieldmark::bench {
namespace {

constexpr int kLeft = 70, kAxis = 720, kRight = 50, kTop = 64, kHeight = 220, kBottom = 56;  // pixels
constexpr double kMargin = 1;  // of the axis, beyond the mark

void check(const Histogram& h) {
  if (h.counts.empty() || !(h.bin > 0) || !std::isfinite(h.bin) || !std::isfinite(h.from) ||
      !std::isfinite(h.mark))
    throw ValueError("[histogram_chart] histogram must have bins of positive width and finite places, got " +
                     std::to_string(h.counts.size()) + " of width " + std::to_string(h.bin));
  if (std::any_of(h.counts.begin(), h.counts.end(), [](std::int64_t n) { return n < 0; }))
    throw ValueError("[histogram_chart] counts must be at least 0");
}

// Maps values and counts to pixels.
class Axes {
 public:
  explicit Axes(const Histogram& h)
      : low_(std::min(h.from, h.mark - kMargin)),
        high_(std::max(h.from + h.bin * static_cast<double>(h.counts.size()), h.mark + kMargin)),
        decades_(std::max(
            1., std::ceil(std::log10(
                    static_cast<double>(*std::max_element(h.counts.begin(), h.counts.end())) + 1)))) {}
  int x(double value) const {
    return kLeft + static_cast<int>(std::lround(kAxis * (value - low_) / (high_ - low_)));
  }
  // The axis begins at 0.5, so that a count of one has a visible height.
  int y(double count) const {
    const double part = std::max(0., std::log10(std::max(count, 0.5) / 0.5) / (decades_ + std::log10(2.)));
    return kTop + kHeight - static_cast<int>(std::lround(kHeight * part));
  }
  std::string ticks() const {
    std::string svg;
    const double step = high_ - low_ > 40 ? 10 : high_ - low_ > 16 ? 4 : 2;
    for (auto i = std::lround(std::ceil(low_ / step)); static_cast<double>(i) * step <= high_; ++i) {
      const double v = static_cast<double>(i) * step;
      svg += svg_line(x(v), kTop + kHeight, x(v), kTop + kHeight + 5, "#555") +
             svg_text(x(v), kTop + kHeight + 20, " text-anchor=\"middle\" fill=\"#333\"", short_number(v));
    }
    for (int decade = 0; decade <= static_cast<int>(decades_); decade += decades_ > 4 ? 2 : 1) {
      const double count = std::pow(10., decade);
      svg += svg_line(kLeft, y(count), kLeft + kAxis, y(count), "#ddd") +
             svg_text(kLeft - 8, y(count) + 4, " text-anchor=\"end\" fill=\"#333\"", short_number(count));
    }
    return svg;
  }

 private:
  double low_, high_, decades_;
};

}  // namespace

std::string histogram_chart(const Histogram& h) {
  check(h);
  const Axes axes(h);
  constexpr int kFoot = kTop + kHeight;
  std::string svg = svg_begin(kLeft + kAxis + kRight, kFoot + kBottom, h.title) + axes.ticks();
  for (std::size_t i = 0; i < h.counts.size(); ++i) {
    if (h.counts[i] == 0) continue;
    const double left = h.from + h.bin * static_cast<double>(i);
    const int x = axes.x(left), y = axes.y(static_cast<double>(h.counts[i]));
    svg += "<rect class=\"bin\" x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\" width=\"" +
           std::to_string(std::max(1, axes.x(left + h.bin) - x - 1)) + "\" height=\"" +
           std::to_string(kFoot - y) + "\" fill=\"#3b6ea5\"/>\n";
  }
  const int mark = axes.x(h.mark);
  const bool to_left = mark > kLeft + kAxis / 2;
  svg += svg_line(kLeft, kFoot, kLeft + kAxis, kFoot, "#555") + "<line class=\"mark\" x1=\"" +
         std::to_string(mark) + "\" x2=\"" + std::to_string(mark) + "\" y1=\"" + std::to_string(kTop - 14) +
         "\" y2=\"" + std::to_string(kFoot) +
         "\" stroke=\"#b03a2e\" stroke-width=\"3\" stroke-dasharray=\"6 3\"/>\n" +
         svg_text(mark + (to_left ? -8 : 8), kTop - 4,
                  std::string(" fill=\"#8c2a20\"") + (to_left ? " text-anchor=\"end\"" : ""), h.mark_label) +
         svg_text(kLeft + kAxis / 2, kFoot + 44, " text-anchor=\"middle\" fill=\"#333\"", h.x);
  return svg + "</svg>\n";
}

}  // namespace fieldmark::bench
