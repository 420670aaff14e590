#pragma once
#include <string>

#include "cli/bench_field.h"

namespace fieldmark::cli {

/// Of `bench embed`.
struct BenchEmbedOptions {
  std::string owner;  ///< file whose field is marked; empty: see `field`
  std::string field;  ///< file; empty: `scene`, trained for a while
  std::string scene;  ///< data set; empty: lego of FIELDMARK_DATA, else the built-in scene
  std::string plot;   ///< SVG file; empty: none
  std::string only;   ///< part of a row's name; the default and what `rows` has are always there
  std::string rows;   ///< file in which rows are kept as they are measured, see EmbedRows; empty: none
  double seconds = 90;
  Index views = 24, bits = 16;
  Index size = 0;  ///< of the views to judge by; 0: as trained
  bool quick = false;
};

/// Embeds a mark in many ways for --seconds each, and prints what is read against time and strength.
int bench_embed(const BenchEmbedOptions& options, Context& context);

}  // namespace fieldmark::cli
