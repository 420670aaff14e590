#include "cli/supersampling.h"

#include <CLI/CLI.hpp>

namespace fieldmark::cli {

void add_supersampling(CLI::App& app, Index& rays) {
  app.add_option("--supersampling", rays,
                 "Rays along each side of a pixel, 1 to 8, whose mean it is: 2 takes four times as long "
                 "(as trained)")
      ->check(CLI::Range(1, 8).description(""))
      ->type_name("N")
      ->default_str("");
}

}  // namespace fieldmark::cli
