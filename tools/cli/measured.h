#pragma once
#include <fieldmark/watermark/measurement.h>

#include "cli/context.h"

namespace fieldmark::cli {

/// What to measure a mark on; the baked field and its message go together.
struct MarkMeasure {
  std::string cameras = "near";  ///< near, ring, sphere or test (then data is needed)
  Index count = 200;             ///< of cameras that are drawn
  Index size = 0;                ///< pixels of the longer side; 0: as in training
  std::string data{};            ///< data set: its test views for `test` cameras and for psnr_photo
  std::vector<std::string> under{};
  const nerf::RadianceField* baked = nullptr;
  const watermark::Message* message = nullptr;
};

/// Measures with progress, prints a table and returns the JSON of `measure`.
Json measure_mark(const watermark::Owner& owner, const MarkMeasure& what, Context& context);

/// Where to find a message of the owner's length in an option. @throws UsageError if it does not fit
watermark::Message read_message(const std::string& hex, const watermark::Owner& owner);

}  // namespace fieldmark::cli
