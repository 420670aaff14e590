#include "cli/manifest.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include "support/catch.h"
#include "support/source_dir.h"
#include "support/temporary_folder.h"

using namespace fieldmark;
using namespace fieldmark::cli;

namespace {

// Source: FIPS 180-2, appendix B.1.
const std::string kSha256OfAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

std::string manifest_text(const std::string& path, const std::string& sha256,
                          const std::string& format = "1") {
  return R"({"format": )" + format + R"(, "name": "n", "kind": "scene", "title": "t", "licence": "l",
    "source": {"citation": "c", "url": "u"}, "files": [{"path": ")" +
         path + R"(", "bytes": 3, "sha256": ")" + sha256 + "\"}]}";
}

}  // namespace

TEST_CASE("verify_manifest tells what is wrong with each file", "[manifest]") {
  const TemporaryFolder folder;
  const auto manifest = parse_manifest(manifest_text("abc", kSha256OfAbc), "m");
  const auto go_on = [](double) { return true; };
  auto faults = verify_manifest(manifest, folder.path, go_on);
  REQUIRE(faults.size() == 1);
  CHECK(faults[0].path == "abc");
  CHECK(faults[0].what == "missing");
  write_file_atomically(folder / "abc", "abcd");
  CHECK(verify_manifest(manifest, folder.path, go_on).at(0).what == "expected 3 bytes, found 4");
  write_file_atomically(folder / "abc", "abd");
  CHECK_THAT(verify_manifest(manifest, folder.path, go_on).at(0).what,
             Contains("expected sha256 " + kSha256OfAbc));
  write_file_atomically(folder / "abc", "abc");
  CHECK(verify_manifest(manifest, folder.path, go_on).empty());
  write_file_atomically(folder / "abc", "");
  CHECK(verify_manifest(manifest, folder.path, [](double) { return false; }).empty());
}

TEST_CASE("parse_manifest refuses what is not a manifest", "[manifest]") {
  CHECK_THROWS_WITH(parse_manifest("{", "m.json"), Contains("m.json: not a manifest"));
  CHECK_THROWS_WITH(parse_manifest("{}", "m.json"), Contains("format"));
  CHECK_THROWS_WITH(parse_manifest(manifest_text("a", kSha256OfAbc, "2"), "m"),
                    Contains("expected 1, found 2"));
  CHECK_THROWS_WITH(parse_manifest(manifest_text("../a", kSha256OfAbc), "m"),
                    Contains("must stay in the folder"));
  CHECK_THROWS_WITH(parse_manifest(manifest_text("/a", kSha256OfAbc), "m"),
                    Contains("must stay in the folder"));
  CHECK_THROWS_WITH(parse_manifest(manifest_text("a", "12"), "m"), Contains("64 hexadecimal digits"));
  CHECK_THROWS_AS(parse_manifest(R"({"format": 1, "name": 3})", "m"), IoError);
}

TEST_CASE("Every embedded manifest is one, and its name is its own", "[manifest]") {
  std::vector<std::string> names;
  for (const auto text : embedded_manifests()) {
    const auto m = parse_manifest(text, "embedded");
    CHECK(std::filesystem::exists(source_dir() + "/data_manifests/" + m.name + ".json"));
    CHECK(!m.files.empty());
    CHECK(!m.licence.empty());
    names.push_back(m.name);
  }
  std::sort(names.begin(), names.end());
  CHECK(std::unique(names.begin(), names.end()) == names.end());
  CHECK(std::find(names.begin(), names.end(), "nerf_synthetic_lego") != names.end());
}
