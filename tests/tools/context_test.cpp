#include "cli/context.h"
#include "cli/cli.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/model_file.h>

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

TEST_CASE("What is left out is named in the text and in the results", "[context]") {
  std::ostringstream out, err;
  Context context({.json = "-"}, {"fieldmark", "x"}, out, err);
  CHECK(!context.left_out());
  context.leave_out("b.png", "b.png: broken");
  CHECK(context.left_out());
  context.result({{"a", 1}});
  const auto json = cli::Json::parse(out.str());
  CHECK(json["left_out"] == cli::Json::parse(R"([{"image": "b.png", "reason": "b.png: broken"}])"));
  CHECK(err.str() == "note: left out, b.png: broken\n");
}

TEST_CASE("Names that are not UTF-8 are written with a mark in the place of foreign bytes", "[context]") {
  const TemporaryFolder folder;
  const std::string json = folder / "r.json", report = folder / "r.md", name = "caf\xe9.png";
  std::ostringstream out, err;
  Context context({.json = json, .report = report}, {"fieldmark", "x"}, out, err);
  context.note(name);
  context.result({{"image", name}, {"views", {{{"image", name}}}}});
  CHECK(cli::Json::parse(read_text(json))["image"] == "caf\xef\xbf\xbd.png");
  CHECK_THAT(read_text(report), Contains("caf\xef\xbf\xbd.png") && !Contains("\xe9"));
}

TEST_CASE("Results replace no model, not even one that the command made", "[context]") {
  const TemporaryFolder folder;
  const std::string path = folder / "a";
  std::ostringstream out, err;
  Context context({.json = path}, {"fieldmark", "x"}, out, err);
  SafetensorsFile field;
  set_model_info(field, {.kind = "field"});
  field.write(path);
  CHECK_THROWS_WITH(context.result({{"a", 1}}), Contains("its FIELD would be lost"));
  CHECK_NOTHROW(SafetensorsFile::read(path));
  CHECK_THROWS_AS(Context({.json = path}, {}, out, err), IoError);
  CHECK_THROWS_WITH(Context({.json = folder / "b", .report = folder / "b"}, {}, out, err),
                    Contains("is the file of --json"));
}

TEST_CASE("A file for results that cannot be made is refused before any work", "[context]") {
  const TemporaryFolder folder;
  std::ostringstream out, err;
  const std::string path = folder / "missing/r.json";
  CHECK_THROWS_AS(Context({.json = path}, {}, out, err), IoError);
  CHECK_THROWS_AS(Context({.report = path}, {}, out, err), IoError);
  CHECK_THROWS_AS(Context({.json = folder / "a", .report = folder / "./a"}, {}, out, err), cli::UsageError);
}
