#include "cli/supersampling.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("supersampling: one ray unless another number of 1 to 8 is given") {
  const auto parsed = [](std::vector<std::string> line) {
    CLI::App app;
    Index rays = 1;
    cli::add_supersampling(app, rays);
    std::reverse(line.begin(), line.end());
    app.parse(line);
    return rays;
  };
  CHECK(parsed({}) == 1);
  CHECK(parsed({"--supersampling", "8"}) == 8);
  for (const char* wrong : {"0", "9", "2.5", "two"})
    CHECK_THROWS_AS(parsed({"--supersampling", wrong}), CLI::ParseError);
}
