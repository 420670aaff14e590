#pragma once
// Building blocks of SVG images. Private.
#include <fieldmark/imaging/markup.h>

#include <cstdio>
#include <string>

namespace fieldmark::bench {

// Returns a white canvas with the title at the upper left. The caller appends "</svg>\n" at the end.
inline std::string svg_begin(int width, int height, const std::string& title) {
  const std::string w = std::to_string(width), h = std::to_string(height);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "\" height=\"" + h + "\" viewBox=\"0 0 " +
         w + " " + h + "\" font-family=\"sans-serif\" font-size=\"13\">\n" +
         "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" +
         "<text x=\"12\" y=\"24\" font-size=\"16\">" + escaped_markup(title) + "</text>\n";
}

// @param attributes  starts with a space, or is empty
inline std::string svg_text(int x, int y, const std::string& attributes, const std::string& text) {
  return "<text x=\"" + std::to_string(x) + "\" y=\"" + std::to_string(y) + "\"" + attributes + ">" +
         escaped_markup(text) + "</text>\n";
}

inline std::string svg_line(int x1, int y1, int x2, int y2, const char* colour) {
  return "<line x1=\"" + std::to_string(x1) + "\" x2=\"" + std::to_string(x2) + "\" y1=\"" +
         std::to_string(y1) + "\" y2=\"" + std::to_string(y2) + "\" stroke=\"" + colour + "\"/>\n";
}

inline std::string short_number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

}  // namespace fieldmark::bench
