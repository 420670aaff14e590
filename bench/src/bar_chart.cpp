#include <fieldmark/bench/bar_chart.h>
#include <fieldmark/engine/error.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::bench {
namespace {

constexpr int kLabel = 230, kAxis = 360, kNote = 250, kRow = 26, kTop = 64;  // pixels

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string text_at(int x, int y, const char* attributes, const std::string& text) {
  return "<text x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\"" + attributes + ">" +
         escaped(text) + "</text>\n";
}

std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace

std::string bar_chart(const std::string& title, const std::vector<Bar>& bars, double full) {
  if (!(full > 0)) throw ValueError("[bar_chart] full must be positive, got " + std::to_string(full));
  const int width = kLabel + kAxis + kNote, height = kTop + kRow * static_cast<int>(bars.size()) + 16;
  std::string svg =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + std::to_string(width) + "\" height=\"" +
      std::to_string(height) + "\" font-family=\"sans-serif\" font-size=\"13\">\n" +
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" + text_at(12, 24, " font-size=\"16\"", title);
  constexpr int kTicks = 4;
  for (int i = 0; i <= kTicks; ++i) {
    const int x = kLabel + kAxis * i / kTicks;
    svg += "<line x1=\"" + std::to_string(x) + "\" x2=\"" + std::to_string(x) + "\" y1=\"" +
           std::to_string(kTop - 8) + "\" y2=\"" + std::to_string(height - 12) + "\" stroke=\"#ccc\"/>\n" +
           text_at(x, kTop - 14, " text-anchor=\"middle\" fill=\"#666\"", short_number(full * i / kTicks));
  }
  int y = kTop;
  for (const Bar& bar : bars) {
    const double part = std::isfinite(bar.value) ? std::clamp(bar.value / full, 0.0, 1.0) : 0;
    const int length = static_cast<int>(std::lround(part * kAxis));
    svg += text_at(kLabel - 8, y + 13, " text-anchor=\"end\"", bar.label) + "<rect class=\"bar\" x=\"" +
           std::to_string(kLabel) + "\" y=\"" + std::to_string(y) + "\" width=\"" + std::to_string(length) +
           "\" height=\"18\" fill=\"#3b6ea5\"/>\n" +
           text_at(kLabel + length + 6, y + 13, " fill=\"#333\"", bar.note);
    y += kRow;
  }
  return svg + "</svg>\n";
}

}  // namespace fieldmark::bench
