#include "cli/supersampling.h"

namespace fieldmark::cli {

void add_supersampling(CommandLine& app, Index& rays) {
  app.add_option(
         "--supersampling", rays,
         "Rays per side of a pixel to average, 1 to 8; 2 takes four times as long; default: as trained")
      ->range(1, 8)
      ->type_name("N")
      ->default_str("");
}

}  // namespace fieldmark::cli
