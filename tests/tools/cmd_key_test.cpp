#include <fieldmark/core/files.h>
#include <fieldmark/watermark/keys/key.h>

#include <nlohmann/json.hpp>

#include "cli/cli.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;

TEST_CASE("key writes 256 new bits each time, whatever the seed", "[key]") {
  const TemporaryFolder folder;
  const std::string a = folder / "a.key", b = folder / "b.key";
  const auto r = run_command({"key", "--out", a, "--seed", "7", "--json", "-"});
  CHECK(r.code == cli::kOk);
  CHECK(nlohmann::json::parse(r.out)["bits"] == 256);
  CHECK(run_command({"key", "--out", b, "--seed", "7"}).code == cli::kOk);
  const auto key = watermark::load_key(a);
  CHECK(!(key == watermark::load_key(b)));
  CHECK(r.out.find(watermark::to_hex(key)) == std::string::npos);
  CHECK(r.err.find(watermark::to_hex(key)) == std::string::npos);
}

TEST_CASE("key keeps a key that exists unless it is forced", "[key]") {
  const TemporaryFolder folder;
  const std::string path = folder / "a.key";
  REQUIRE(run_command({"key", "--out", path}).code == cli::kOk);
  const auto before = read_bytes(path);
  const auto refused = run_command({"key", "--out", path});
  CHECK(refused.code == cli::kFailed);
  CHECK_THAT(refused.err, Contains(path + ": exists already"));
  CHECK(read_bytes(path) == before);
  CHECK(run_command({"key", "--out", path, "--force"}).code == cli::kOk);
  CHECK(read_bytes(path) != before);
}

TEST_CASE("key without a file to write is a usage error", "[key]") {
  CHECK(run_command({"key"}).code == cli::kUsage);
  CHECK(run_command({"key", "--out", "/no/such/folder/a.key"}).code == cli::kFailed);
}
