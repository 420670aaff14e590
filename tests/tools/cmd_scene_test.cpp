#include <fieldmark/core/files.h>
#include <fieldmark/nerf/dataset.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

namespace {
// Returns the bytes of every file below a folder, by its path in the folder.
std::map<std::string, std::vector<std::byte>> files_of(const std::filesystem::path& folder) {
  std::map<std::string, std::vector<std::byte>> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder).string()] = read_bytes(entry.path());
  return files;
}
}  // namespace

TEST_CASE("scene writes a data set that loads, the same bytes for the same seed", "[scene]") {
  const TemporaryFolder folder;
  const std::string a = folder / "a", b = folder / "b", c = folder / "c";
  const std::vector<std::string> words{"scene", "--kind", "sphere", "--size", "8", "--views", "2", "--out"};
  const auto with = [&](const std::string& out, const std::string& seed) {
    auto all = words;
    all.insert(all.end(), {out, "--seed", seed, "--json", "-"});
    return run_command(all);
  };
  const auto r = with(a, "3");
  CHECK(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["images"] == 4);
  CHECK_THAT(r.err, Contains("4 views of 8x8"));
  REQUIRE(with(b, "3").code == cli::kOk);
  REQUIRE(with(c, "4").code == cli::kOk);
  const auto there = with(a, "3");
  CHECK(there.code == cli::kFailed);
  CHECK_THAT(there.err, Contains("expected a folder without a data set, found transforms_train.json"));
  const auto set = nerf::load_dataset(a, {.split = "train"});
  CHECK(set.views.size() == 2);
  CHECK(set.views[0].camera.width == 8);
  CHECK(files_of(b) == files_of(a));
  CHECK(files_of(a).size() >= 6);  // two lists of cameras and four images
  CHECK(read_text(a + "/transforms_train.json") != read_text(c + "/transforms_train.json"));
}

TEST_CASE("scene refuses what it cannot draw or write", "[scene]") {
  CHECK(run_command({"scene"}).code == cli::kUsage);
  for (const auto& [option, value] : {std::pair{"--kind", "cube"}, {"--size", "0"}, {"--views", "100001"}}) {
    const auto r = run_command({"scene", "--out", "/tmp/none", option, value});
    CHECK(r.code == cli::kUsage);
    CHECK_THAT(r.err, Contains(option) && Contains(value));
  }
  const auto r = run_command({"scene", "--out", "/dev/null/x", "--size", "8", "--views", "1"});
  CHECK(r.code == cli::kFailed);
  CHECK_THAT(r.err, Contains("/dev/null"));
}
