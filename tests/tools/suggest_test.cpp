#include "cli/suggest.h"

#include "support/catch.h"

using fieldmark::cli::edit_distance;
using fieldmark::cli::nearest_word;

TEST_CASE("edit_distance counts insertions, deletions and replacements", "[suggest]") {
  CHECK(edit_distance("", "") == 0);
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("abc", "") == 3);
  CHECK(edit_distance("kitten", "sitting") == 3);
  CHECK(edit_distance("train", "trian") == 2);
  CHECK(edit_distance("same", "same") == 0);
}

TEST_CASE("nearest_word answers only with what is near", "[suggest]") {
  const std::vector<std::string> words{"train", "extract", "eval", "key"};
  CHECK(nearest_word("extrct", words) == "extract");
  CHECK(nearest_word("evla", words) == "");
  CHECK(nearest_word("eva", words) == "eval");
  CHECK(nearest_word("kei", words) == "key");
  CHECK(nearest_word("something", words) == "");
  CHECK(nearest_word("x", {}) == "");
}
