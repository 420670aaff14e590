#include <fieldmark/core/files.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"
#include "tools/tiny_job.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;

TEST_CASE("export writes a page, a point cloud and a mesh, the same for any thread count", "[export]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder));
  const auto written = [&](const std::string& name, std::vector<std::string> more,
                           const std::string& threads) {
    std::vector<std::string> words{"export", "--field", field,       "--out", folder / name,
                                   "--json", "-",       "--threads", threads};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome r = run_command(words);
    INFO(r.err);
    REQUIRE(r.code == cli::kOk);
    const auto json = nlohmann::json::parse(r.out);
    CHECK(json["file_bytes"] == std::filesystem::file_size(folder / name));
    CHECK(json.contains(name == "a.html" ? "views" : "vertices"));
    return read_text(folder / name);
  };
  const std::vector<std::string> page{"--size", "16", "--rows", "2", "--columns", "3"},
      surface{"--resolution", "24", "--density", "5"};
  const std::string html = written("a.html", page, "2"), ply = written("a.ply", surface, "2"),
                    glb = written("a.glb", surface, "2");
  CHECK_THAT(html, Contains("const rows = 2, columns = 3, closed = true"));
  CHECK(ply.starts_with("ply\n"));
  CHECK(glb.starts_with("glTF"));
  CHECK(html == written("a.html", page, "1"));
  CHECK(ply == written("a.ply", surface, "1"));
  CHECK(glb == written("a.glb", surface, "1"));
}

TEST_CASE("export refuses what it cannot write, and options of another kind of file", "[export]") {
  const TemporaryFolder folder;
  const std::string field = tiny_field(folder, tiny_scene(folder));
  const auto run = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"export", "--field", field};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const auto refused = [&](std::vector<std::string> more, const std::string& text) {
    const Outcome r = run(more);
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains(text));
  };
  refused({"--out", folder / "a.obj"}, "expected a file that ends in .html, .ply or .glb");
  refused({"--out", folder / "a.html", "--density", "3"}, "--resolution, --density: only for .ply and .glb");
  refused({"--out", folder / "a.ply", "--rows", "3"}, "only for .html files; a .ply has no images");
  const Outcome empty = run({"--out", folder / "a.ply", "--resolution", "8", "--density", "100000"});
  CHECK(empty.code == cli::kFailed);
  CHECK_THAT(empty.err, Contains("no surface has a density of") && Contains("choose another --density"));
  CHECK(!std::filesystem::exists(folder / "a.ply"));
  const Outcome missing = run({"--out", "/nowhere/a.glb"});
  CHECK(missing.code == cli::kFailed);
  CHECK_THAT(missing.err, Contains("/nowhere/a.glb"));
}
