#pragma once
#include <fieldmark/tools/results/report.h>

namespace fieldmark::results {

/// An SVG file of a benchmark's result.
/// @param name    "engine", "field", "embed", "embed-curves", "attacks" or "attacks-fields"
/// @param result  of the `bench` command   @return "" if there is no point to draw
/// @throws ValueError if there is no such chart
std::string result_chart(const std::string& name, const Json& result);

/// Writes the charts of `bench NAME`: NAME to `path`, and its companion beside it (attacks-fields.svg).
/// @throws IoError
void write_charts(const std::string& name, const std::string& path, const Json& result);
/// The files that write_charts() writes.
Words chart_files(const std::string& name, const std::string& path);

/// How fast a row of `bench engine` is, in the unit of its kind.
std::string engine_speed(const Json& row);

}  // namespace fieldmark::results
