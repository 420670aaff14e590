#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/imaging/line_chart.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "svg.h"

namespace fieldmark::bench {
namespace {

// Pixels.
constexpr int kLeft = 60, kWidth = 560, kTop = 56, kHeight = 320, kBottom = 52, kRow = 20;
constexpr int kMark = 46, kLetter = 8;   // of the legend: room before a name, and per letter
constexpr int kTicks = 5;                // of y, besides the lowest
constexpr std::size_t kMostPlaces = 16;  // of x with a line each; beyond that, round numbers
constexpr std::array<const char*, 10> kColours{"#1f6fb4", "#d9541e", "#2b8a3e", "#9036a8", "#a87b00",
                                               "#00838f", "#c2185b", "#555555", "#7cb342", "#5c4033"};

struct Axes {
  double x0, x1, y0, y1;
  int x(double value) const {
    return kLeft + static_cast<int>(std::lround((value - x0) / (x1 - x0) * kWidth));
  }
  int y(double value) const {
    const double part = std::clamp((value - y0) / (y1 - y0), 0.0, 1.0);
    return kTop + kHeight - static_cast<int>(std::lround(part * kHeight));
  }
};

// Returns the x positions of grid lines: those of the points, or about five to ten multiples of 1, 2 or 5
// times a power of ten.
std::set<double> ticks_of(const std::set<double>& places) {
  if (places.size() <= kMostPlaces) return places;
  const double low = *places.begin(), high = *places.rbegin();
  double step = std::pow(10.0, std::floor(std::log10((high - low) / 5)));
  for (const double factor : {5.0, 2.0})
    if ((high - low) / (factor * step) >= 5) {
      step *= factor;
      break;
    }
  std::set<double> ticks;
  for (double i = std::ceil(low / step); i * step <= high; ++i) ticks.insert(i * step);
  return ticks;
}

std::string frame(const Axes& axes, const std::set<double>& places) {
  std::string svg;
  const int foot = kTop + kHeight;
  int last = -100;  // leaves space for a number
  for (const double x : places) {
    svg += svg_line(axes.x(x), kTop, axes.x(x), foot, "#eee");
    if (axes.x(x) - last < 28) continue;
    last = axes.x(x);
    svg += svg_text(last, foot + 18, " text-anchor=\"middle\" fill=\"#666\"", short_number(x));
  }
  for (int i = 0; i <= kTicks; ++i) {
    const double y = axes.y0 + (axes.y1 - axes.y0) * i / kTicks;
    svg += svg_line(kLeft, axes.y(y), kLeft + kWidth, axes.y(y), "#ddd") +
           svg_text(kLeft - 8, axes.y(y) + 4, " text-anchor=\"end\" fill=\"#666\"", short_number(y));
  }
  return svg;
}

std::string drawn(const Axes& axes, const LineSeries& line, const std::string& colour, int row) {
  const std::string stroke = " fill=\"none\" stroke-width=\"2\" stroke=\"" + colour + "\"" +
                             (line.dashed ? " stroke-dasharray=\"5 4\"" : "");
  std::string path, dots;
  for (const auto& p : line.points) {
    const std::string x = std::to_string(axes.x(p.x)), y = std::to_string(axes.y(p.y));
    path += x + "," + y + " ";
    dots += "<circle class=\"point\" cx=\"" + x + "\" cy=\"" + y + "\" r=\"3\" fill=\"" + colour + "\"/>\n";
  }
  const int left = kLeft + kWidth + 16, y = kTop + 6 + row * kRow;
  const auto polyline = [&](const std::string& points) {
    return "<polyline" + stroke + " points=\"" + points + "\"/>\n";
  };
  return polyline(path) + dots +
         polyline(std::to_string(left) + "," + std::to_string(y) + " " + std::to_string(left + 24) + "," +
                  std::to_string(y)) +
         svg_text(left + 30, y + 4, "", line.name);
}

}  // namespace

std::string line_chart(const ScatterText& text, const std::vector<LineSeries>& lines, double y_low,
                       double y_high) {
  if (!(y_low < y_high))
    throw ValueError("[line_chart] y_low must be below y_high, got " + number_text(y_low) + " and " +
                     number_text(y_high));
  std::vector<LineSeries> kept;
  std::set<double> places;
  for (LineSeries line : lines) {
    std::erase_if(line.points, [](const auto& p) { return !std::isfinite(p.x) || !std::isfinite(p.y); });
    std::stable_sort(line.points.begin(), line.points.end(),
                     [](const auto& a, const auto& b) { return a.x < b.x; });
    for (const auto& p : line.points) places.insert(p.x);
    if (!line.points.empty()) kept.push_back(std::move(line));
  }
  if (kept.empty()) throw ValueError("[line_chart] lines must have a point that is finite");
  const double margin = std::max(0.04 * (*places.rbegin() - *places.begin()), 1e-3);
  const Axes axes{*places.begin() - margin, *places.rbegin() + margin, y_low, y_high};
  const int rows = static_cast<int>(kept.size());
  std::size_t letters = 0;
  for (const LineSeries& line : kept) letters = std::max(letters, line.name.size());
  std::string svg = svg_begin(kLeft + kWidth + kMark + kLetter * static_cast<int>(letters),
                              std::max(kTop + kHeight + kBottom, kTop + (rows + 1) * kRow), text.title) +
                    frame(axes, ticks_of(places)) +
                    svg_text(kLeft + kWidth / 2, kTop + kHeight + 40, " text-anchor=\"middle\"", text.x) +
                    svg_text(kLeft, kTop - 10, "", text.y);
  for (int i = 0; i < rows; ++i)
    svg += drawn(axes, kept[static_cast<std::size_t>(i)],
                 kColours[static_cast<std::size_t>(i) % kColours.size()], i);
  return svg + "</svg>\n";
}

}  // namespace fieldmark::bench
