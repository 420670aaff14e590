#include "cli/supersampling.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("supersampling: the number given, 1 to 8, or what was there before") {
  const auto parsed = [](std::vector<std::string> line) {
    CLI::App app;
    cli::CommandLine options(app);
    Index rays = 0;
    cli::add_supersampling(options, rays);
    std::reverse(line.begin(), line.end());
    app.parse(line);
    return rays;
  };
  CHECK(parsed({}) == 0);
  CHECK(parsed({"--supersampling", "8"}) == 8);
  for (const char* wrong : {"0", "9", "2.5", "two"})
    CHECK_THROWS_AS(parsed({"--supersampling", wrong}), CLI::ParseError);
}
