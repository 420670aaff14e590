#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/watermark/keys/key.h>

#include <sys/stat.h>

#include <set>
#include <vector>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("key: random keys differ and use every bit") {
  std::set<std::string> seen;
  std::array<std::uint8_t, 32> any{}, all;
  all.fill(0xff);
  for (int i = 0; i < 100; ++i) {
    const Key key = random_key();
    seen.insert(to_hex(key));
    for (std::size_t k = 0; k < any.size(); ++k) {
      any[k] = static_cast<std::uint8_t>(any[k] | key.bytes[k]);
      all[k] = static_cast<std::uint8_t>(all[k] & key.bytes[k]);
    }
  }
  CHECK(seen.size() == 100);
  for (std::size_t k = 0; k < any.size(); ++k) {  // a fair bit stays put with probability 2^-99
    CHECK(any[k] == 0xff);
    CHECK(all[k] == 0);
  }
}

TEST_CASE("key: from bytes and to hex") {
  const Key key = test_key(0);
  CHECK(to_hex(key) == "000102030405060708090a0b0c0d0e0f101112131415161718191a1b1c1d1e1f");
  std::vector<std::uint8_t> bytes(key.bytes.begin(), key.bytes.end());
  CHECK(key_from_bytes(bytes) == key);
  bytes.pop_back();
  CHECK_THROWS_AS(key_from_bytes(bytes), ValueError);
  CHECK_THROWS_WITH(key_from_bytes(bytes), "[key_from_bytes] bytes: must have 32 entries, got 31");
}

TEST_CASE("key: a saved key is loaded again, equal keys give equal files that only their owner can read") {
  const TemporaryFolder folder;
  const auto path = folder / "my.key", twin = folder / "twin.key";
  const mode_t mask = ::umask(0);
  save_key(path, test_key(200));
  ::umask(mask);
  save_key(twin, test_key(200));
  CHECK(load_key(path) == test_key(200));
  CHECK(read_bytes(path) == read_bytes(twin));
  using std::filesystem::perms;
  CHECK(std::filesystem::status(path).permissions() == (perms::owner_read | perms::owner_write));
  CHECK(SafetensorsFile::read(path).metadata.at("fieldmark") == R"({"format":1,"kind":"key"})");
}

TEST_CASE("key: another kind of file and a key of another length are refused") {
  const TemporaryFolder folder;
  const auto path = folder / "x.safetensors";
  const auto write = [&](const char* kind, Index bytes) {
    SafetensorsFile file;
    set_model_info(file, {.kind = kind});
    file.add("key", {bytes}, std::vector<std::uint8_t>(static_cast<std::size_t>(bytes)));
    file.write(path);
  };
  write("owner", 32);
  CHECK_THROWS_AS(load_key(path), IoError);
  CHECK_THROWS_WITH(load_key(path), path.string() + ": expected a KEY file (kind 'key'), found kind 'owner'");
  write("key", 31);
  CHECK_THROWS_WITH(load_key(path), path.string() + ": tensor \"key\": expected 32 bytes, found 31");
  CHECK_THROWS_AS(load_key(folder / "none"), IoError);
}
