#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/tools/results/rows.h>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::results;

namespace {
const Plan& plan() {
  static const Plan plan(
      "kind train: core\nkind eval: core\nscene lego lego\n"
      "a: train --data scene:lego --out @a.field\nb: eval --field @a.field\n");
  return plan;
}

Json row_of(const char* id, const Json& inputs, const Json& output) {
  const PlannedRow& row = *plan().find(id);
  Json json = make_row({.id = row.id,
                        .kind = row.kind,
                        .command = row.command,
                        .result = {{"psnr", 30.5}},
                        .inputs = inputs,
                        .output = output,
                        .code = plan().code(row),
                        .seconds = 2});
  json["commit"] = "0123456789ab";
  return json;
}
}  // namespace

TEST_CASE("rows: a row comes back from its file, and a file that is none is named") {
  const TemporaryFolder folder;
  Json row = row_of("a", Json::object(), nullptr);
  row["id"] = "x/y";
  save_row(folder.path, row);
  const Rows rows = load_rows(folder.path);
  REQUIRE(rows.size() == 1);
  CHECK(rows.at("x/y") == row);
  CHECK(row["date"].get<std::string>().size() == 10);
  CHECK(load_rows(folder / "nowhere").empty());
  write_file_atomically(folder / "z.json", "{}");
  CHECK_THROWS_WITH(load_rows(folder.path), Contains("z.json: expected a row"));
  write_file_atomically(folder / "z.json", row.dump());
  CHECK_THROWS_WITH(load_rows(folder.path), Contains("z.json: expected the row of this name"));
}

TEST_CASE("with_names: paths below the places become names, and nothing else changes") {
  const Places places{.data = "/there/data", .work = "/here/made"};
  const Json result{{"image", "/here/made/views/0.png"},
                    {"images", {"/here/made/views/1.png", "/there/data/lego/r_0.png"}},
                    {"other", {{"path", "/here/madeer/a"}, {"psnr", 30.5}, {"none", nullptr}}}};
  CHECK(with_names(result, places) ==
        Json{{"image", "@views/0.png"},
             {"images", {"@views/1.png", "data/lego/r_0.png"}},
             {"other", {{"path", "/here/madeer/a"}, {"psnr", 30.5}, {"none", nullptr}}}});
  CHECK(with_names(Json("/there/data/a"), {.data = {}, .work = "/here"}) == "/there/data/a");
}

TEST_CASE("hash_of: files by their bytes, folders by names and bytes") {
  const TemporaryFolder folder;
  CHECK(hash_of(folder / "nothing").is_null());
  write_file_atomically(folder / "a", "one");
  CHECK(hash_of(folder / "a") == sha256_hex("one"));
  const Json before = hash_of(folder.path);
  std::filesystem::rename(folder / "a", folder / "b");
  CHECK(hash_of(folder.path) != before);
  CHECK(hash_of(folder.path) == sha256_hex("b " + sha256_hex("one") + "\n"));
}

TEST_CASE("stale_reason: each thing that a row depends on") {
  const TemporaryFolder data;
  std::filesystem::create_directory(data / "lego");
  write_file_atomically(data / "lego/image", "pixels");
  const Places places{.data = data.path, .work = data.path};
  Rows rows;
  const auto why = [&](const char* id) { return stale_reason(plan(), *plan().find(id), rows, places); };
  CHECK(why("a") == "not measured");
  rows["a"] = row_of("a", {{"scene:lego", hash_of(data / "lego")}}, "hash of a");
  rows["b"] = row_of("b", {{"@a.field", "hash of a"}}, nullptr);
  CHECK(why("a").empty());
  CHECK(why("b").empty());
  rows["a"]["output"] = "another";  // trained again
  CHECK(why("b") == "input changed: a.field");
  rows["a"]["inputs"]["scene:lego"] = "another";
  CHECK(why("a") == "input changed: scene:lego");
  CHECK(stale_reason(plan(), *plan().find("a"), rows, {.data = {}, .work = {}})
            .empty());  // the data is not there to compare
  rows["a"]["code"] = "another";
  CHECK(why("a") == "code changed");
  rows["a"]["command"] = "another";
  CHECK(why("a") == "command changed");
  rows["a"]["commit"] = "0123456789ab + changes";
  CHECK(why("a") == "measured from changed sources");
  rows["a"]["inputs"] = nullptr;
  CHECK(why("a") == "measured by version 0.1");
  rows["a"]["schema"] = kSchema + 1;
  CHECK(why("a") == "another schema");
}
