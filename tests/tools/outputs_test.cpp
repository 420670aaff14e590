#include "cli/outputs.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/watermark/keys/key.h>

#include <unistd.h>
#include <filesystem>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

using namespace fieldmark;
using namespace fieldmark::cli;
namespace fs = std::filesystem;

namespace {
/// Writes a file of the given kind with one array.
void write_model(const fs::path& path, const char* kind, const char* array) {
  SafetensorsFile file;
  set_model_info(file, {.kind = kind});
  file.add(array, {1}, std::vector<float>{1});
  file.write(path);
}
}  // namespace

TEST_CASE("outputs: a secret is never replaced, a field by fields alone") {
  const TemporaryFolder folder;
  watermark::save_key(folder / "a.key", watermark::random_key());
  write_model(folder / "owner", "owner", "w");
  write_model(folder / "checkpoint", "training", "key");
  write_model(folder / "run.checkpoint", "checkpoint", "w");
  write_model(folder / "field", "field", "w");
  write_file_atomically(folder / "text", "text");
  for (const char* name : {"a.key", "owner", "checkpoint", "run.checkpoint"}) {
    const auto before = read_bytes(folder / name);
    CHECK_THROWS_WITH(check_writable(folder / name),
                      Contains(std::string(name) + ": exists already") && Contains("name another file"));
    CHECK_THROWS_AS(check_writable_page(folder / name), IoError);
    fs::create_symlink(folder / name, folder / "link");
    CHECK_THROWS_AS(check_writable(folder / "link"), IoError);
    fs::remove(folder / "link");
    CHECK(read_bytes(folder / name) == before);
  }
  CHECK_NOTHROW(check_writable(folder / "field"));
  CHECK_THROWS_WITH(check_writable_page(folder / "field"), Contains("its FIELD would be lost"));
  for (const char* name : {"text", "new"}) {
    CHECK_NOTHROW(check_writable(folder / name));
    CHECK_NOTHROW(check_writable_page(folder / name));
  }
  CHECK(!fs::exists(folder / "new"));
  CHECK_THROWS_WITH(check_writable(folder.path), Contains("found a folder; name a file"));
  CHECK_THROWS_AS(check_writable(folder / "missing/file"), IoError);
  CHECK_THROWS_WITH(check_writable_page(folder / "missing/file"),
                    Contains("missing/file: its folder") && Contains("missing does not exist; create it"));
  CHECK_THROWS_WITH(check_writable(folder / "view.PNG"),
                    Contains("view.PNG: has the name of an image; name another file"));
  CHECK_NOTHROW(check_writable("/dev/null"));
}

TEST_CASE(
    "outputs: what may be a secret is kept, though it cannot be read, is damaged or of a later version") {
  const TemporaryFolder folder;
  watermark::save_key(folder / "whole", watermark::random_key());
  const std::string bytes = read_text(folder / "whole");
  write_file_atomically(folder / "cut", std::string_view(bytes).substr(0, bytes.size() - 5));
  std::string later = bytes;
  const auto format = later.find("format");
  REQUIRE(format != std::string::npos);
  later[later.find('1', format)] = '2';
  write_file_atomically(folder / "later", later);
  for (const char* name : {"cut", "later"})
    CHECK_THROWS_WITH(check_writable(folder / name),
                      Contains("its damaged or later model would be lost") && Contains("move this one away"));
  write_file_atomically(folder / "brackets", "12345678{\"");  // text, not the length of a header
  CHECK_NOTHROW(check_writable(folder / "brackets"));
  fs::permissions(folder / "whole", fs::perms::none);
  fs::permissions(folder.path, fs::perms::all);
  const bool root = ::geteuid() == 0;  // who reads everything
  if (root) REQUIRE(::seteuid(65534) == 0);
  CHECK_THROWS_WITH(check_writable(folder / "whole"),
                    Contains("content, which cannot be read, would be lost"));
  if (root) REQUIRE(::seteuid(0) == 0);
}

TEST_CASE("outputs: a folder is made and tried") {
  const TemporaryFolder folder;
  prepare_folder(folder / "a/b");
  CHECK(fs::is_directory(folder / "a/b"));
  CHECK(fs::is_empty(folder / "a/b"));
  CHECK_NOTHROW(prepare_folder(folder / "a/b"));
  write_file_atomically(folder / "file", "x");
  CHECK_THROWS_WITH(prepare_folder(folder / "file"), Contains("found a file; name another folder"));
  CHECK_THROWS_WITH(prepare_folder(folder / "file/b"), Contains("file/b: the folder cannot be made"));
  CHECK_THROWS_AS(prepare_folder("/proc"), IoError);
}

// Each command names a missing input: outputs are checked before inputs are read.
TEST_CASE("outputs: every command refuses a secret and a folder in the place of its file before it works") {
  const TemporaryFolder folder;
  const std::string key = folder / "a.key", dir = folder / "dir";
  watermark::save_key(key, watermark::random_key());
  fs::create_directory(dir);
  const auto before = read_bytes(key);
  const std::vector<std::vector<std::string>> commands{
      {"train", "--data", "missing", "--out"},
      {"embed", "--field", "missing", "--out"},
      {"embed", "--field", "missing", "--out", folder / "o.fm", "--image"},
      {"bake", "--owner", "missing", "--message", "5", "--out"},
      {"attack-field", "missing", "--attack", "float16", "--out"},
      {"render", "--field", "missing", "--out", folder / "v", "--against", "missing", "--sheet"},
      {"key", "--force", "--out"},
      {"info", "missing", "--json"},
      {"info", "missing", "--report"},
      {"bench", "engine", "--plot"},
      {"bench", "field", "--plot"},
      {"bench", "embed", "--plot"},
      {"bench", "attacks", "--field", "missing", "--owner", "missing", "--message", "5", "--plot"},
  };
  for (const auto& command : commands)
    for (const auto& out : {key, dir}) {
      auto words = command;
      words.push_back(out);
      if (words[0] == "key" && out == key) continue;  // the only way to replace a key
      const Outcome r = run_command(words);
      INFO(words[0] << " " << words[1] << ": " << r.err);
      CHECK(r.code == kFailed);
      CHECK_THAT(r.err, Contains(out) && Contains(out == key ? "KEY would be lost" : "found a folder"));
      CHECK(read_bytes(key) == before);
    }
  write_model(folder / "owner", "owner", "w");
  CHECK_THAT(run_command({"key", "--force", "--out", folder / "owner"}).err, Contains("expected a KEY file"));
}
