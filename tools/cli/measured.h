#pragma once
#include <fieldmark/watermark/attacks/measurement.h>

#include <iosfwd>
#include <optional>
#include <string>

#include "cli/context.h"

namespace fieldmark::cli {

/// Returns --informed-count: as given, or `usual`; 0 for an owner without cells.
/// @throws UsageError if views are asked for of an owner without cells
Index informed_views(std::optional<Index> given, Index usual, const watermark::Owner& owner);

/// Returns the figures that `measure` and `embed` report. @param cameras  name of their set
Json measurement_json(const watermark::Measurement& measured, const std::string& cameras);

/// Flattens the figures into a row of a table; figures of --distort carry the reading after their names.
Json measurement_row(const watermark::Measurement& measured, const std::string& cameras);

/// Prints the same figures for people, one per line.
void print_measurement(std::ostream& out, const watermark::Measurement& measured, const std::string& cameras);

/// Runs watermark::measure() with progress. @throws Interrupted on Ctrl-C
watermark::Measurement run_measure(const watermark::Owner& owner, const nerf::RadianceField* baked,
                                   const watermark::Message* message, watermark::MeasureOptions options,
                                   Context& context);

}  // namespace fieldmark::cli
