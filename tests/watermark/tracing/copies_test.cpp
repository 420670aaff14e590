#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/tracing/copies.h>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("copies: the key of a copy depends on the owner's key and on every byte of the name") {
  const Key anna = copy_key(test_key(1), "Anna");
  CHECK(anna == derive_key(test_key(1), "fieldmark copy Anna", 0));
  CHECK_FALSE(anna == copy_key(test_key(2), "Anna"));
  CHECK_FALSE(anna == copy_key(test_key(1), "anna"));
  CHECK_FALSE(anna == copy_key(test_key(1), "Anna "));
  CHECK_FALSE(anna == test_key(1));
  CHECK_THROWS_WITH(copy_key(test_key(1), ""), "[copy_key] name must not be empty");
}

TEST_CASE("copies: recipients stand one a line, each once") {
  const TemporaryFolder folder;
  const auto path = folder / "names.txt";
  write_file_atomically(path, "Anna\r\n\n  Bertil B. \nÅsa\n");
  CHECK(read_recipients(path) == std::vector<std::string>{"Anna", "Bertil B.", "Åsa"});
  write_file_atomically(path, "Anna\nBertil\n Anna\n");
  CHECK_THROWS_WITH(read_recipients(path),
                    Contains("line 3: expected each recipient once, found 'Anna' of line 1 again"));
  write_file_atomically(path,
                        "\xEF\xBB\xBF"
                        "Anna\n");  // with the mark of some editors
  CHECK(read_recipients(path) == std::vector<std::string>{"Anna"});
  write_file_atomically(path, "Anna\nBer\ttil\n");
  CHECK_THROWS_WITH(read_recipients(path), Contains("line 2: recipient: expected a name without"));
  for (const char* name : {"", " Anna", "Anna ", "An\nna", "An\x7Fna"})
    CHECK_THROWS_AS(check_recipient(name), ValueError);
  for (const char* name : {"Anna", "Studio A", "\xC3\x85sa"}) CHECK_NOTHROW(check_recipient(name));
  write_file_atomically(path, "\n \n");
  CHECK_THROWS_WITH(read_recipients(path), Contains("expected one recipient a line, found none"));
  CHECK_THROWS_AS(read_recipients(folder / "missing.txt"), IoError);
}
