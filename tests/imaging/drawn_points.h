#pragma once
#include <regex>
#include <string>
#include <vector>

/// The position at which a chart's point was drawn.
struct Place {
  int x, y;
};

/// Returns all points of an SVG file, in file order.
inline std::vector<Place> places(const std::string& svg) {
  std::vector<Place> found;
  const std::regex circle("<circle [^>]*>"), x("cx=\"(\\d+)\""), y("cy=\"(\\d+)\"");
  for (std::sregex_iterator i(svg.begin(), svg.end(), circle), end; i != end; ++i) {
    const std::string text = i->str();
    std::smatch cx, cy;
    if (text.find("class=\"point\"") != std::string::npos && std::regex_search(text, cx, x) &&
        std::regex_search(text, cy, y))
      found.push_back({std::stoi(cx[1]), std::stoi(cy[1])});
  }
  return found;
}
