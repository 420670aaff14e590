#include <fieldmark/core/error.h>
#include <fieldmark/tools/results/page.h>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::results;

namespace {
Rows two_rows() {
  const auto row = [](const char* id, const Json& result) {
    return Json{{"id", id},       {"command", "eval"}, {"commit", "abc"}, {"date", "2026-01-02"},
                {"cpu", "C"},     {"isa", "v3"},       {"threads", 2},    {"compiler", "GNU"},
                {"seconds", 2.4}, {"result", result}};
  };
  return {{"a", row("a", {{"psnr", 30.126}, {"in", {{"share", 0.98765}}}, {"list", {{{"x", 1}, {"y", 2}}}}})},
          {"b", row("b", {{"list", {{{"x", 3}, {"y", nullptr}}}}})}};
}

Pages render(const char* text) {
  return render_pages(text, two_rows(),
                      [](const std::string& id) { return id == "b" ? "code changed" : ""; });
}
}  // namespace

TEST_CASE("render_pages: figures of rows in each format") {
  const Pages pages = render(
      "before\n%page p.md\n[[a psnr .2]] [[a in/share %]] [[a psnr g2]] [[a psnr]] [[a none .2]] [[c x]]\n");
  REQUIRE(pages.size() == 1);
  CHECK(pages.at("p.md") == "30.13 98.77% 30 30.126 - -\n");
  CHECK(render("%page p\n[[a status]] [[b status]] [[c status]]\n").at("p") == "fresh stale -\n");
}

TEST_CASE("render_pages: lists of several rows, and where all rows come from") {
  const std::string page = render("%page p\n%list a,b list x\n[[a psnr]]\n%provenance\n").at("p");
  CHECK_THAT(page, Contains("| x |\n| --- |\n| 1 |\n| 3 |\n"));
  CHECK_THAT(page, Contains("| a | `eval` | abc | 2026-01-02 | C | v3 | 2 | GNU | 2 | fresh |\n| b |") &&
                       Contains("| stale: code changed |"));
  CHECK_THAT(render("%page p\n%list c list\n").at("p"), Contains("Not measured."));
}

TEST_CASE("render_pages: lines about a missing row give way to one that says so") {
  CHECK(render("%page p\n%measured a\n[[a psnr .1]] dB\n%end-measured\nafter\n").at("p") ==
        "30.1 dB\nafter\n");
  CHECK(render("%page p\n%measured c\n[[c psnr .1]] dB\n%list c list\n%end-measured\nafter\n").at("p") ==
        "Not measured.\nafter\n");
}

TEST_CASE("render_pages: a bad template is refused") {
  CHECK_THROWS_WITH(render("%page p\n%dance\n"), Contains("no directive is '%dance'"));
  CHECK_THROWS_WITH(render("%page p\n[[a psnr\n"), Contains("no ']]'"));
  CHECK_THROWS_WITH(render("%page p\n[[a]]\n"), Contains("expected ID PATH"));
}

TEST_CASE("render_pages: the project's pages need no row to render") {
  const Pages pages = render_pages(project_pages(), {}, [](const std::string&) { return "not measured"; });
  for (const char* name : {"README.md", "mark.md", "main_job.md", "quality.md", "attacks.md", "engine.md"})
    CHECK(pages.contains(name));
  for (const auto& [name, text] : pages)
    CHECK_THAT(text, !Contains("[[") && !Contains("{s}") && !Contains("%for"));
}
