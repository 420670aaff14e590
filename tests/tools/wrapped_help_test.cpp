#include "cli/wrapped_help.h"

#include "support/catch.h"

using fieldmark::cli::wrapped;

TEST_CASE("wrapped_help: lines break between words, and where the text breaks them") {
  CHECK(wrapped("", 5).empty());
  CHECK(wrapped("one two", 7) == "one two");
  CHECK(wrapped("one two", 6) == "one\ntwo");
  CHECK(wrapped("one two three", 7) == "one two\nthree");
  CHECK(wrapped("one\ntwo three", 5) == "one\ntwo\nthree");
  CHECK(wrapped("a\n\nb\n", 5) == "a\n\nb\n");
  CHECK(wrapped("hippopotamus and", 5) == "hippopotamus\nand");
  CHECK(wrapped("an hippopotamus", 5) == "an\nhippopotamus");
  CHECK(wrapped("hippopotamus\nand", 5) == "hippopotamus\nand");
}
