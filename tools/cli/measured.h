#pragma once
#include <fieldmark/watermark/attacks/measurement.h>

#include <iosfwd>
#include <string>

#include "cli/context.h"

namespace fieldmark::cli {

/// The figures that `measure` and `embed` report. @param cameras  name of their set
Json measurement_json(const watermark::Measurement& measured, const std::string& cameras);

/// Its figures side by side, as a row of a table: those of --distort with the reading behind their names.
Json measurement_row(const watermark::Measurement& measured, const std::string& cameras);

/// The same for people: a line a figure.
void print_measurement(std::ostream& out, const watermark::Measurement& measured, const std::string& cameras);

/// watermark::measure() with progress. @throws Interrupted on Ctrl-C
watermark::Measurement run_measure(const watermark::Owner& owner, const nerf::RadianceField* baked,
                                   const watermark::Message* message, watermark::MeasureOptions options,
                                   Context& context);

}  // namespace fieldmark::cli
