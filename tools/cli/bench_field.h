#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/radiance_field.h>

#include <memory>
#include <string>

#include "cli/command_line.h"

namespace fieldmark::cli {

class Context;

/// Of `bench field` and `bench training`.
struct BenchFieldOptions {
  std::string field;  ///< file; empty: trained for `seconds`
  std::string
      scene;  ///< data set that the views are of; empty: lego of FIELDMARK_DATA, else the built-in scene
  std::string plot;  ///< SVG file; empty: none
  Index size = 400, views = 3;
  double seconds = 60;
  int runs = 5;
  bool quick = false;
};
/// Adds what `bench engine` does not have: --field, --size, --views, --seconds and --quick.
void add_bench_field(CommandLine& app, BenchFieldOptions& options);

/// lego of FIELDMARK_DATA, or empty where there is none.
std::string lego_folder();

/// A split of a data set, or of the built-in scene where no folder is given; `quick` makes that one small.
nerf::Dataset bench_split(const std::string& folder, const std::string& split, bool quick);

/// A field trained on a data set for a while, with progress. @throws Interrupted on Ctrl-C
std::unique_ptr<nerf::RadianceField> trained_field(const nerf::Dataset& data, double seconds,
                                                   Context& context);

/// Renders a field in many ways, and prints speed against error.
int bench_field(const BenchFieldOptions& options, Context& context);

}  // namespace fieldmark::cli
