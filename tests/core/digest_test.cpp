#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>

#include <filesystem>
#include <fstream>

#include "support/catch.h"
#include "support/temporary_folder.h"

using namespace fieldmark;

TEST_CASE("digest: the standard's examples (FIPS 180-4)") {
  CHECK(sha256_hex("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(sha256_hex("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(sha256_hex(std::string(1000000, 'a')) ==
        "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("digest: files up to longer than the read buffer") {
  const TemporaryFolder folder;
  const std::string path = folder / "digest.bin";
  for (std::size_t size : {std::size_t{0}, std::size_t{1} << 20, (std::size_t{3} << 20) + 17}) {
    std::string text(size, '\0');
    for (std::size_t i = 0; i < size; ++i) text[i] = static_cast<char>(i * 2654435761u >> 7);
    std::ofstream(path, std::ios::binary) << text;
    CHECK(sha256_file_hex(path) == sha256_hex(text));
  }
}

TEST_CASE("digest: a missing file and a folder are named") {
  CHECK_THROWS_AS(sha256_file_hex("/nowhere/at all"), IoError);
  CHECK_THROWS_WITH(sha256_file_hex("/nowhere/at all"),
                    Contains("/nowhere/at all") && Contains("No such file"));
  CHECK_THROWS_WITH(sha256_file_hex(std::filesystem::temp_directory_path()), Contains("found: a folder"));
}
