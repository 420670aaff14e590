#include "cli/context.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <sstream>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using cli::Context;

TEST_CASE("Results on standard output send the text for people to standard error", "[context]") {
  std::ostringstream out, err;
  Context both({.json = "-"}, {"fieldmark", "x"}, out, err);
  both.text() << "text";
  both.result({{"a", 1}});
  CHECK(err.str() == "text");
  CHECK(cli::Json::parse(out.str()) == cli::Json{{"a", 1}});
}

TEST_CASE("Results go to the files named, and the text stays on standard output", "[context]") {
  const TemporaryFolder folder;
  const std::string json = folder / "r.json", report = folder / "r.md";
  std::ostringstream out, err;
  Context context({.json = json, .report = report}, {"fieldmark", "x"}, out, err);
  CHECK(folder.entries() == 0);
  context.text() << "text";
  context.result({{"psnr", 30.5}});
  CHECK(out.str() == "text");
  CHECK(cli::Json::parse(read_text(json)) == cli::Json{{"psnr", 30.5}});
  CHECK_THAT(read_text(report), Contains("# x") && Contains("| psnr | 30.5 |"));
}

TEST_CASE("A file for results that cannot be made is refused before any work", "[context]") {
  const TemporaryFolder folder;
  std::ostringstream out, err;
  const std::string path = folder / "missing/r.json";
  CHECK_THROWS_AS(Context({.json = path}, {}, out, err), IoError);
  CHECK_THROWS_AS(Context({.report = path}, {}, out, err), IoError);
}
