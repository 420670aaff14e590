#include "highest.h"

#include <algorithm>
#include <vector>

#include "support/catch.h"

using fieldmark::watermark::highest;

namespace {

struct Looked {
  std::size_t top, values;
};

Looked look(const std::vector<double>& v) {
  std::size_t values = 0;
  const std::size_t top = highest(v.size(), [&](std::size_t i) {
    ++values;
    return v.at(i);
  });
  return {top, values};
}

}  // namespace

TEST_CASE("highest: finds the maximum of a function with one, wherever it is") {
  for (const std::size_t count : {1u, 2u, 3u, 8u, 13u})
    for (std::size_t top = 0; top < count; ++top) {
      std::vector<double> v(count);
      for (std::size_t i = 0; i < count; ++i)
        v[i] = i < top ? -1.5 * static_cast<double>(top - i) : -static_cast<double>(i - top);
      CAPTURE(count, top);
      const Looked looked = look(v);
      CHECK(looked.top == top);
      CHECK(looked.values <= count / 2 + 3);
    }
}

TEST_CASE("highest: returns the first of equal values, and the higher of two wide maxima") {
  CHECK(look(std::vector<double>(13, 2)).top == 0);
  CHECK(look({0, 1, 3, 3, 3, 1}).top == 2);
  CHECK(look({0, 3, 3, 3, 1, 0}).top == 1);
  CHECK(look({1, 2, 1, 0, 2, 4, 3}).top == 5);
  CHECK(look({3, 4, 3, 0, 1, 2, 1}).top == 1);
}
