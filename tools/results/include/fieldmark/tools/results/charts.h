#pragma once
#include <fieldmark/tools/results/report.h>

namespace fieldmark::results {

/// Draws the result of a benchmark as an SVG file.
/// @param name    "engine", "field", "embed", "embed-curves", "attacks" or "attacks-fields"
/// @param result  of the `bench` command   @return "" if there is no point to draw
/// @throws ValueError if there is no such chart
std::string result_chart(const std::string& name, const Json& result);

/// Writes the charts of `bench NAME`: NAME to `path`, and its companion next to it (attacks-fields.svg).
/// @throws IoError
void write_charts(const std::string& name, const std::string& path, const Json& result);
/// Returns the files that write_charts() writes.
Words chart_files(const std::string& name, const std::string& path);

/// Formats the speed of a row of `bench engine` in the unit of its kind.
std::string engine_speed(const Json& row);

}  // namespace fieldmark::results
