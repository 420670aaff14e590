#include <fieldmark/core/files.h>
#include <fieldmark/core/private_folder.h>

#include "support/catch.h"

using namespace fieldmark;

TEST_CASE("private_folder: only its owner has access, and it is gone at the end") {
  std::filesystem::path path;
  {
    const PrivateFolder folder("test"), other("test");
    path = folder.path;
    CHECK(path != other.path);
    CHECK(std::filesystem::status(path).permissions() == std::filesystem::perms::owner_all);
    write_file_atomically(folder / "a", "b");
  }
  CHECK(!std::filesystem::exists(path));
}
