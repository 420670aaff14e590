#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/imaging/scatter_chart.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "svg.h"

namespace fieldmark::bench {
namespace {

// Pixels.
constexpr int kLeft = 64, kWidth = 760, kRight = 40, kTop = 84, kHeight = 460, kBottom = 56, kLetter = 7,
              kLine = 14;
constexpr std::array<const char*, 8> kColours{"#222222", "#1f6fb4", "#d9541e", "#2b8a3e",
                                              "#9036a8", "#a87b00", "#00838f", "#c2185b"};

struct Axes {
  double x0, x1, y0, y1;  // x as logarithms
  int x(double value) const {
    return kLeft + static_cast<int>(std::lround((std::log10(value) - x0) / (x1 - x0) * kWidth));
  }
  int y(double value) const {
    return kTop + kHeight - static_cast<int>(std::lround((value - y0) / (y1 - y0) * kHeight));
  }
};

// Returns a step of 1, 2 or 5 times a power of ten that gives at most ten ticks.
double tick_step(double range) {
  const double power = std::pow(10, std::floor(std::log10(range / 10)));
  for (const double times : {1.0, 2.0, 5.0})
    if (range / (times * power) <= 10) return times * power;
  return 10 * power;
}

// Returns the x positions of grid lines: 1, 2 and 5 times the powers of ten, or whole steps if fewer than
// three of those are visible.
std::vector<double> x_ticks(const Axes& axes) {
  std::vector<double> ticks;
  for (int power = static_cast<int>(std::floor(axes.x0)); power <= axes.x1; ++power)
    for (const double times : {1.0, 2.0, 5.0})
      if (const double at = std::log10(times) + power; at >= axes.x0 && at <= axes.x1)
        ticks.push_back(times * std::pow(10, power));
  if (ticks.size() >= 3) return ticks;
  const double low = std::pow(10, axes.x0), high = std::pow(10, axes.x1), step = tick_step(high - low);
  ticks.clear();
  for (auto i = std::lround(std::ceil(low / step)); static_cast<double>(i) * step <= high; ++i)
    ticks.push_back(static_cast<double>(i) * step);
  return ticks;
}

Axes axes_of(const std::vector<ScatterPoint>& points, double y_most) {
  Axes axes{1e300, -1e300, 1e300, -1e300};
  for (const auto& p : points) {
    axes.x0 = std::min(axes.x0, std::log10(p.x)), axes.x1 = std::max(axes.x1, std::log10(p.x));
    axes.y0 = std::min(axes.y0, p.y), axes.y1 = std::max(axes.y1, p.y);
  }
  const double margin = std::max(0.05 * (axes.x1 - axes.x0), 0.02);
  axes.x0 -= margin, axes.x1 += margin;
  const double step = tick_step(std::max(axes.y1 - axes.y0, 1e-3));
  axes.y0 = std::floor(axes.y0 / step - 0.1) * step, axes.y1 = std::ceil(axes.y1 / step + 0.1) * step;
  while (axes.y1 > y_most + step / 2 && axes.y1 > axes.y0 + 1.5 * step) axes.y1 -= step;
  return axes;
}

std::string grid_lines(const Axes& axes) {
  std::string svg;
  const int foot = kTop + kHeight;
  for (const double value : x_ticks(axes))
    svg += svg_line(axes.x(value), kTop, axes.x(value), foot, "#ddd") +
           svg_text(axes.x(value), foot + 18, " text-anchor=\"middle\" fill=\"#666\"", short_number(value));
  const double step = tick_step(axes.y1 - axes.y0);
  const auto last = static_cast<int>(std::floor((axes.y1 - axes.y0) / step + 0.5));
  for (int i = 0; i <= last; ++i) {
    const double value = axes.y0 + i * step;
    svg += svg_line(kLeft, axes.y(value), kLeft + kWidth, axes.y(value), "#ddd") +
           svg_text(kLeft - 8, axes.y(value) + 4, " text-anchor=\"end\" fill=\"#666\"",
                    short_number(std::abs(value) < step / 2 ? 0 : value));
  }
  return svg;
}

struct Box {
  int left, right, y;
  bool meets(const Box& o) const { return left < o.right && o.left < right && std::abs(y - o.y) < kLine; }
};

// Places a label at the first position next to the point that no earlier label occupies.
std::string place_label(int x, int y, const std::string& text, std::vector<Box>& taken) {
  const int wide = kLetter * static_cast<int>(text.size()), most = kLeft + kWidth + kRight;
  for (int away = 0; away < 12; ++away)
    for (const int side : {1, -1})
      for (const int up : {-1, 1}) {
        const int left = side > 0 ? x + 9 : x - 9 - wide;
        const Box box{left, left + wide, y + 4 + up * away * kLine};
        if (box.left < kLeft || box.right > most || box.y < kTop + kLine || box.y > kTop + kHeight - 4)
          continue;
        if (std::any_of(taken.begin(), taken.end(), [&](const Box& o) { return box.meets(o); })) continue;
        taken.push_back(box);
        return (away > 1 ? svg_line(x, y, side > 0 ? left : left + wide, box.y - 4, "#bbb") : "") +
               svg_text(side > 0 ? left : left + wide, box.y,
                        side > 0 ? " font-size=\"11\"" : " font-size=\"11\" text-anchor=\"end\"", text);
      }
  return "";
}

std::string polyline(const Axes& axes, std::vector<ScatterPoint> points) {
  std::erase_if(points, [](const auto& p) { return !p.line; });
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) { return a.x < b.x; });
  std::string svg =
      "<polyline class=\"front\" fill=\"none\" stroke=\"#999\" stroke-dasharray=\"4 3\" points=\"";
  for (const auto& p : points) svg += std::to_string(axes.x(p.x)) + "," + std::to_string(axes.y(p.y)) + " ";
  return points.empty() ? "" : svg + "\"/>\n";
}

const char* colour_of(std::size_t series) { return kColours[series % kColours.size()]; }

// Draws one line per series, with its name next to the last point.
std::string curves(const Axes& axes, const std::vector<ScatterPoint>& points, std::vector<Box>& taken) {
  std::string lines, names;
  std::vector<std::string> done;
  for (const auto& first : points) {
    if (std::find(done.begin(), done.end(), first.series) != done.end()) continue;
    const char* colour = colour_of(done.size());
    done.push_back(first.series);
    int x = 0, y = 0;
    lines += "<polyline class=\"curve\" fill=\"none\" stroke=\"" + std::string(colour) + "\" points=\"";
    for (const auto& p : points) {
      if (p.series != first.series) continue;
      x = axes.x(p.x), y = axes.y(p.y);
      lines += std::to_string(x) + "," + std::to_string(y) + " ";
    }
    lines += "\"/>\n";
    names += place_label(x, y, first.series, taken);
  }
  return lines + names;
}

std::string circle(int x, int y, int radius, const std::string& attributes) {
  return "<circle cx=\"" + std::to_string(x) + "\" cy=\"" + std::to_string(y) + "\" r=\"" +
         std::to_string(radius) + "\"" + attributes + "/>\n";
}

}  // namespace

std::string scatter_chart(const ScatterText& text, const std::vector<ScatterPoint>& points) {
  std::vector<ScatterPoint> drawn;
  for (const auto& p : points) {
    if (p.x <= 0) throw ValueError("[scatter_chart] x must be positive, got " + number_text(p.x));
    if (std::isfinite(p.x) && std::isfinite(p.y)) drawn.push_back(p);
  }
  if (drawn.empty()) throw ValueError("[scatter_chart] points must have one that is finite");
  const Axes axes = axes_of(drawn, text.y_most);
  std::string svg = svg_begin(kLeft + kWidth + kRight, kTop + kHeight + kBottom, text.title) +
                    grid_lines(axes) +
                    svg_text(kLeft + kWidth / 2, kTop + kHeight + 42, " text-anchor=\"middle\"", text.x) +
                    svg_text(kLeft, kTop - 8, "", text.y) + (text.curves ? "" : polyline(axes, drawn));
  std::vector<std::string> series;
  std::vector<Box> taken;
  taken.reserve(drawn.size());
  int legend = kLeft;
  for (const auto& p : drawn) taken.push_back({axes.x(p.x) - 5, axes.x(p.x) + 5, axes.y(p.y) + 4});
  if (text.curves) svg += curves(axes, drawn, taken);
  std::string labels;
  for (const auto& p : drawn) {
    auto known = std::find(series.begin(), series.end(), p.series);
    const bool fresh = known == series.end();
    if (fresh) known = series.insert(known, p.series);
    const std::string fill =
        std::string(" fill=\"") + colour_of(static_cast<std::size_t>(known - series.begin())) + "\"";
    if (fresh && !text.curves) {
      svg += circle(legend, 46, 5, fill) + svg_text(legend + 10, 50, "", p.series);
      legend += 30 + 8 * static_cast<int>(p.series.size());
    }
    const int x = axes.x(p.x), y = axes.y(p.y);
    svg += circle(x, y, p.line ? 5 : 4, " class=\"point\"" + fill + (p.line ? "" : " fill-opacity=\"0.45\""));
    if (p.ring) svg += circle(x, y, 9, " fill=\"none\" stroke=\"#222\" stroke-width=\"2\"");
    if (!p.label.empty()) labels += place_label(x, y, p.label, taken);
  }
  return svg + labels + "</svg>\n";
}

}  // namespace fieldmark::bench
