#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/imaging/bar_chart.h>

#include <algorithm>
#include <cmath>

#include "svg.h"

namespace fieldmark::bench {
namespace {

constexpr int kLabel = 230, kAxis = 360, kNote = 250, kRow = 26, kTop = 64;  // pixels

}  // namespace

std::string bar_chart(const std::string& title, const std::vector<Bar>& bars, double full) {
  check_number("bar_chart", "full", full, full > 0, "positive");
  const int width = kLabel + kAxis + kNote, height = kTop + kRow * static_cast<int>(bars.size()) + 16;
  std::string svg = svg_begin(width, height, title);
  constexpr int kTicks = 4;
  for (int i = 0; i <= kTicks; ++i) {
    const int x = kLabel + kAxis * i / kTicks;
    svg += svg_line(x, kTop - 8, x, height - 12, "#ccc") +
           svg_text(x, kTop - 14, " text-anchor=\"middle\" fill=\"#666\"", short_number(full * i / kTicks));
  }
  int y = kTop;
  for (const Bar& bar : bars) {
    const double part = std::isfinite(bar.value) ? std::clamp(bar.value / full, 0.0, 1.0) : 0;
    const int length = static_cast<int>(std::lround(part * kAxis));
    svg += svg_text(kLabel - 8, y + 13, " text-anchor=\"end\"", bar.label) + "<rect class=\"bar\" x=\"" +
           std::to_string(kLabel) + "\" y=\"" + std::to_string(y) + "\" width=\"" + std::to_string(length) +
           "\" height=\"18\" fill=\"#3b6ea5\"/>\n" +
           svg_text(kLabel + length + 6, y + 13, " fill=\"#333\"", bar.note);
    y += kRow;
  }
  return svg + "</svg>\n";
}

}  // namespace fieldmark::bench
