#include <fieldmark/core/error.h>
#include <fieldmark/tools/results/plan.h>

#include "support/catch.h"
#include "support/include_graph.h"

using namespace fieldmark;
using namespace fieldmark::results;

TEST_CASE("expanded: loops come once for each turn, and nest") {
  CHECK(expanded("a\n%for x y = 1 p~q; 2 r\n{x}\n%for z = {y}; s\n{x}{z}\n%end\n%end\nb") ==
        Words{"a", "1", "1p q", "1s", "2", "2r", "2s", "b"});
  CHECK_THROWS_WITH(expanded("%for x = 1\n{x}"), Contains("'%end'"));
  CHECK_THROWS_WITH(expanded("%for x y = 1\n%end"), Contains("expected 2 values a turn"));
}

TEST_CASE("plan: rows with their inputs, outputs and what makes them") {
  const Plan plan(
      "# rows\nkind train: core engine\nkind bench payload: core\nscene lego nerf/lego\n"
      "f/a: train --data scene:lego --out @f/a.field --seconds 3\n"
      "f/b: train --field @f/a.field --more @f/a.field\nb: bench payload --bits 9\n");
  REQUIRE(plan.rows().size() == 3);
  CHECK(plan.rows()[0].inputs() == Words{"scene:lego"});
  CHECK(plan.rows()[0].output() == "@f/a.field");
  CHECK(plan.rows()[1].inputs() == Words{"@f/a.field"});
  CHECK(plan.rows()[1].output().empty());
  CHECK(plan.rows()[2].kind == "bench payload");
  CHECK(plan.rows()[2].command == "bench payload --bits 9");
  CHECK(plan.producer("@f/a.field")->id == "f/a");
  CHECK(plan.producer("@f/a.field/view.png")->id == "f/a");
  CHECK(plan.producer("@f/a.fields") == nullptr);
  CHECK(plan.find("f/b")->id == "f/b");
  CHECK(plan.find("f") == nullptr);
  CHECK(plan.scene("lego") == "nerf/lego");
  CHECK(plan.scene("nobody").empty());
  CHECK(plan.code(plan.rows()[0]) == code_hash({"core", "engine"}));
}

TEST_CASE("plan: a line that is wrong is refused by name") {
  CHECK_THROWS_WITH(Plan("a: fly --out @b"), Contains("a: kind must be declared, got 'fly'"));
  CHECK_THROWS_WITH(Plan("kind eval: core\na: eval --field @b"), Contains("nothing makes the input '@b'"));
  CHECK_THROWS_WITH(Plan("kind eval: core\na: eval scene:x"), Contains("'scene:x'"));
  CHECK_THROWS_WITH(Plan("kind eval: core\na: eval\na: eval"), Contains("'a' again"));
  CHECK_THROWS_WITH(Plan("hello"), Contains("got 'hello'"));
}

TEST_CASE("plan: every row of the project has code, and its rooms exist") {
  CHECK(Plan::project().rows().size() > 200);
  for (const PlannedRow& row : Plan::project().rows()) CHECK(Plan::project().code(row).size() == 64);
}

TEST_CASE("plan: a kind names every room that its command's source reaches by includes") {
  const IncludeGraph graph;
  const auto source = [](std::string kind) {
    if (!kind.starts_with("bench ")) kind = "cmd_" + kind;
    std::ranges::replace_if(
        kind, [](char c) { return c == ' ' || c == '-'; }, '_');
    return "tools/cli/" + kind + ".cpp";
  };
  const auto unnamed = [&](const std::string& file, const Words& rooms) {
    std::vector<std::string> ways;
    for (const auto& [room, way] : graph.reached(file)) {
      const auto holds = [&](const std::string& named) {
        return room == named || room.starts_with(named + "/");
      };
      // The shell of commands and the writing of pages do not decide what a row says.
      if (room != "tools/cli" && room != "tools/results" && std::ranges::none_of(rooms, holds))
        ways.push_back(way);
    }
    return ways;
  };
  CHECK(Plan::project().kinds().size() > 20);
  for (const auto& [kind, rooms] : Plan::project().kinds()) {
    CAPTURE(kind);
    CHECK(unnamed(source(kind), rooms) == std::vector<std::string>{});
  }
  const auto ways = unnamed(source("embed"), {"core", "engine", "imaging", "nerf", "distort", "watermark"});
  REQUIRE(ways.size() == 1);
  CHECK_THAT(ways[0], Contains("tools/cli/cmd_embed.cpp > ") && Contains(" > extractor/"));
}
