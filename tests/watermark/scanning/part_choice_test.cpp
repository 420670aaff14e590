#include "part_choice.h"

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using watermark::PartChoice;

TEST_CASE("part_choice: a whole object needs less than a quarter, and a small part more than a large one") {
  const PartChoice none;
  CHECK(none.needed(true, 60) == 0.9);
  CHECK(none.needed(false, 60) == 0.94);
  CHECK(none.needed(true, 59) == 0.97);
  CHECK(none.needed(false, 48) == 0.97);
  CHECK(std::isinf(none.needed(true, 47)));
  CHECK_FALSE(none.is_final());
}

TEST_CASE("part_choice: a place of the same kind must agree more than the one that is chosen") {
  PartChoice choice;
  choice.take(false, 60, 0.945);
  CHECK(choice.needed(false, 200) == 0.945);
  CHECK_FALSE(choice.is_final());
  choice.take(false, 80, 0.95);
  CHECK(choice.is_final());
  PartChoice small;
  small.take(false, 50, 0.99);
  CHECK(small.needed(false, 59) == 0.99);
  CHECK_FALSE(small.is_final());
}

TEST_CASE("part_choice: a large part replaces a small one and a whole object a quarter, not the reverse") {
  PartChoice small;
  small.take(false, 50, 0.99);
  CHECK(small.needed(false, 60) == 0.94);
  CHECK(small.needed(true, 60) == 0.9);
  CHECK(small.needed(true, 50) == 0.97);
  PartChoice large;
  large.take(true, 60, 0.91);
  CHECK(std::isinf(large.needed(true, 59)));
  CHECK(std::isinf(large.needed(false, 100)));
  CHECK(large.needed(true, 70) == 0.91);
}
