#include "cli/supersampling.h"

namespace fieldmark::cli {

void add_supersampling(CommandLine& app, Index& rays) {
  app.add_option("--supersampling", rays,
                 "Rays along each side of a pixel, 1 to 8, whose mean it is: 2 takes four times as long "
                 "(as trained)")
      ->range(1, 8)
      ->type_name("N")
      ->default_str("");
}

}  // namespace fieldmark::cli
