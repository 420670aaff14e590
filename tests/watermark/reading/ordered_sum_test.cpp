#include "ordered_sum.h"
#include <fieldmark/core/error.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Numbers of very different sizes, so that the order of a sum shows in its last bits.
double number(Index i) {
  return std::sin(static_cast<double>(i)) * std::pow(10.0, static_cast<double>(i % 13));
}

double sum_of(Index n, Index chunk = kPixelChunk) {
  return ordered_sum(
      n, 0.0,
      [](Index begin, Index end, double& part) {
        for (Index i = begin; i < end; ++i) part += number(i);
      },
      chunk);
}

struct Counts {
  std::vector<Index> of;
  Counts& operator+=(const Counts& other) {
    for (std::size_t i = 0; i < of.size(); ++i) of[i] += other.of[i];
    return *this;
  }
};
}  // namespace

TEST_CASE("ordered_sum: adds chunks in order, whatever the number of threads") {
  for (const Index n :
       {Index{0}, Index{1}, kPixelChunk - 1, kPixelChunk, kPixelChunk + 1, 3 * kPixelChunk + 5}) {
    CAPTURE(n);
    double want = 0;
    for (Index begin = 0; begin < n; begin += kPixelChunk) {
      double part = 0;
      for (Index i = begin; i < std::min(n, begin + kPixelChunk); ++i) part += number(i);
      want += part;
    }
    for (const int threads : {1, 2, 3}) {
      const ScopedThreads scope(threads);
      CHECK(sum_of(n) == want);
    }
  }
  CHECK(sum_of(1000, 7) != sum_of(1000, 1000));  // other chunks round differently
}

TEST_CASE("ordered_sum: every chunk starts from zero, and every index counts once") {
  const Counts counts = ordered_sum(
      100, Counts{std::vector<Index>(7)},
      [](Index begin, Index end, Counts& part) {
        for (Index i = begin; i < end; ++i) ++part.of[static_cast<std::size_t>(i % 7)];
      },
      9);
  for (Index i = 0; i < 7; ++i) CHECK(counts.of[static_cast<std::size_t>(i)] == (i < 2 ? 15 : 14));
}

TEST_CASE("ordered_sum: an exception of a chunk reaches the caller") {
  const auto fail = [](Index begin, Index, double&) {
    if (begin > 0) throw ValueError("[test] second chunk");
  };
  CHECK_THROWS_WITH(ordered_sum(3 * kPixelChunk, 0.0, fail), "[test] second chunk");
}
