#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/bar_chart.h>
#include <fieldmark/imaging/pareto.h>
#include <fieldmark/imaging/scatter_chart.h>
#include <fieldmark/tools/results/charts.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

namespace fieldmark::results {
namespace {

using bench::ScatterPoint;

double number(const Json& row, const char* key) {
  const auto found = row.find(key);
  return found == row.end() || found->is_null() ? std::nan("") : found->get<double>();
}

// Returns a setting, which may be a word or a number.
std::string text(const Json& row, const char* key) {
  const Json& value = row.at(key);
  return value.is_string() ? value.get<std::string>() : value.dump();
}

template <class... T>
std::string printed(const char* format, T... values) {
  char line[200];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

std::string scatter(const bench::ScatterText& about, const std::vector<ScatterPoint>& points) {
  const bool any = std::ranges::any_of(
      points, [](const ScatterPoint& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
  return any ? bench::scatter_chart(about, points) : "";
}

// Bars show fractions of the peak; look-ups and steps, which have none, show only their notes.
std::string engine_chart(const Json& result) {
  std::vector<bench::Bar> bars;
  double longest =
      1;  // Winograd's convolution takes fewer operations than counted, so it may exceed the peak
  for (const Json& row : result.at("rows")) {
    const double part = number(row, "ratio_to_peak"), ratio = number(row, "peer_ratio");
    bars.push_back({text(row, "name"), part, engine_speed(row)});
    if (std::isfinite(ratio))
      bars.push_back({"PyTorch", part / ratio, printed("PyTorch, %.2f x our time", ratio)});
    longest = std::max({longest, bars.back().value, std::isfinite(part) ? part : 0});
  }
  return bench::bar_chart(printed("Part of the peak of %.0f GFLOP/s, kernels %s",
                                  number(result, "peak_gflops"), text(result, "isa").c_str()),
                          bars, std::ceil(longest));
}

std::string field_chart(const Json& result) {
  // Recomputes the front of the visible points without a margin, so that the line rises.
  std::vector<bench::SpeedQuality> seen;
  for (const Json& row : result.at("rows")) seen.push_back({number(row, "seconds"), number(row, "psnr")});
  const std::vector<bool> line = bench::pareto_front(seen, {.time = 0, .psnr = 0});
  std::vector<ScatterPoint> points;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Json& row = result["rows"][i];
    points.push_back({.x = seen[i].seconds,
                      .y = seen[i].psnr,
                      .series = text(row, "knob"),
                      .label = line[i] && i > 0 ? text(row, "setting") : "",
                      .line = line[i],
                      .ring = i == 0});
  }
  return scatter({.title = "Rendering " + text(result, "field") + ": speed against error",
                  .x = "seconds a view (dashed: the front; ring: the default)",
                  .y = "PSNR against the reference, dB"},
                 points);
}

constexpr const char* kChartBits = "bits right in one view, blind, %";

std::string variant(const Json& row) {
  return text(row, "choice") == "default" ? "default" : text(row, "choice") + ": " + text(row, "setting");
}

std::string embed_chart(const Json& result) {
  std::vector<ScatterPoint> points;
  for (const Json& row : result.at("rows")) {
    const bool first = variant(row) == "default", front = row.at("front").get<bool>();
    points.push_back(
        {.x = number(row, "seconds"),
         .y = 100 * number(row, "accuracy"),
         .series = first                             ? "default"
                   : text(row, "choice") == "length" ? "default, other lengths"
                   : front                           ? "on the front"
                                                     : "others",
         .label = front ? variant(row) + printed(", %.1f dB", number(row, "psnr_foreground")) : "",
         .ring = first});
  }
  return scatter({.title = "Embedding in " + text(result, "field") + ": accuracy against time",
                  .x = "seconds of embedding (ring: the default; names: on the front)",
                  .y = kChartBits,
                  .y_most = 100},
                 points);
}

// Draws the learning curves of the default and of the variants on the front.
std::string embed_curves(const Json& result) {
  Words drawn;
  for (const Json& row : result.at("rows"))
    if (row.at("front").get<bool>() || variant(row) == "default") drawn.push_back(variant(row));
  std::vector<ScatterPoint> points;
  for (const Json& p : result.at("curves"))
    if (std::ranges::find(drawn, variant(p)) != drawn.end())
      points.push_back({.x = number(p, "seconds"), .y = 100 * number(p, "accuracy"), .series = variant(p)});
  return scatter({.title = "Embedding in " + text(result, "field") + ": accuracy while it trains",
                  .x = "seconds of embedding",
                  .y = kChartBits,
                  .curves = true,
                  .y_most = 100},
                 points);
}

// "int8-blocks" -> "int-blocks", "noise_0.1" -> "noise"
std::string family(const std::string& attack) {
  const std::size_t line = attack.rfind('_');
  if (line != std::string::npos && attack.find(',') == std::string::npos) return attack.substr(0, line);
  std::string name = attack.substr(0, attack.find(','));
  if (name.starts_with("int")) name.erase(3, 1);
  return name;
}

// Draws damage as an error in grey levels, increasing to the right, as severities do.
std::string attacks_chart(const Json& result, const char* key, const char* title) {
  std::vector<ScatterPoint> points;
  bool chosen = false;
  for (const Json& row : result.at(key)) {
    chosen = chosen || std::isfinite(number(row, "chosen"));
    points.push_back({.x = 255 * std::pow(10, -number(row, "psnr_foreground") / 20),
                      .y = 100 * number(row, std::isfinite(number(row, "chosen")) ? "chosen" : "blind"),
                      .series = family(text(row, "attack"))});
  }
  std::erase_if(points, [](const ScatterPoint& p) { return !(p.x > 0); });
  return scatter(
      {.title = title,
       .x = "damage on the foreground, rms error in grey levels (2.55: 40 dB, 8.1: 30 dB, 25.5: 20 dB)",
       .y = std::string("bits right in one view, ") + (chosen ? "chosen detection" : "blind") + ", %",
       .curves = true,
       .y_most = 100},
      points);
}

}  // namespace

std::string engine_speed(const Json& row) {
  if (number(row, "gflops") > 0)
    return printed("%.2f of peak, %.1f GFLOP/s", number(row, "ratio_to_peak"), number(row, "gflops"));
  if (number(row, "ratio_to_memory") > 0)
    return printed("%.2f of memory's speed, %.1f GB/s", number(row, "ratio_to_memory"),
                   number(row, "gigabytes_per_second"));
  const double rate = number(row, "items_per_second");
  if (text(row, "name").starts_with("node_")) return printed("%.1f ns an op", 1e9 / rate);
  if (number(row, "ratio_to_scalar") > 0)
    return printed("%.1f ns a point, %.2f x scalar", 1e9 / rate, number(row, "ratio_to_scalar"));
  return printed("%.3f million samples/s", rate * 1e-6);
}

std::string result_chart(const std::string& name, const Json& result) {
  if (name == "engine") return engine_chart(result);
  if (name == "field") return field_chart(result);
  if (name == "embed") return embed_chart(result);
  if (name == "embed-curves") return embed_curves(result);
  if (name == "attacks") return attacks_chart(result, "images", "Attacks on images: accuracy against damage");
  if (name == "attacks-fields")
    return attacks_chart(result, "fields", "Attacks on the field: accuracy against damage");
  throw ValueError("[result_chart] name must be that of a chart, got '" + name + "'");
}

Words chart_files(const std::string& name, const std::string& path) {
  const std::string companion = name == "embed" ? "-curves" : name == "attacks" ? "-fields" : "";
  if (companion.empty()) return {path};
  std::filesystem::path other = path;
  other.replace_filename(other.stem().string() + companion + other.extension().string());
  return {path, other.string()};
}

void write_charts(const std::string& name, const std::string& path, const Json& result) {
  const Words files = chart_files(name, path);
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string chart = result_chart(i == 0            ? name
                                           : name == "embed" ? "embed-curves"
                                                             : "attacks-fields",
                                           result);
    if (!chart.empty()) write_file_atomically(files[i], chart);
  }
}

}  // namespace fieldmark::results
