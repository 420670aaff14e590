#pragma once
#include <fieldmark/engine/parallel.h>
#include <fieldmark/engine/tape.h>

#include <string>

#include "support/catch.h"
#include "support/random.h"

/// Returns random square matrices [.., n, n] in [-1, 1), with 3, 4, .. added to the diagonal.
template <class T = double>
fieldmark::Tensor<T> regular(fieldmark::Shape shape, unsigned seed) {
  fieldmark::Tensor<T> t = uniform<T>(shape, -1, 1, seed);
  const fieldmark::Index n = shape[-1];
  for (fieldmark::Index i = 0; i < t.size(); ++i)
    if (i / n % n == i % n) t[i] += static_cast<T>(3 + i % n);
  return t;
}

/// Fails unless an op of a batch with several bad matrices, filled with `bad`, names the first by its place,
/// on one and on two threads.
/// @param f  called with a Var [4000, 3, 3], of which an op takes 1,213 at a time
template <class F>
void expect_first_bad_named(const F& f, const std::string& op, double bad = 0) {
  auto a = regular({4000, 3, 3}, 1);
  // The first is the second chunk's last but a few; later chunks start with one, so that another thread meets
  // it before.
  for (const fieldmark::Index which : {2400, 2401, 2430, 3640, 3999})
    for (fieldmark::Index i = 0; i < 9; ++i) a[which * 9 + i] = bad;
  for (const int threads : {1, 2})
    for (int repeat = 0; repeat < 5; ++repeat) {
      const fieldmark::ScopedThreads scope(threads);
      fieldmark::Tape<double> tape;
      CHECK_THROWS_WITH(f(tape.constant(a)), Contains("[" + op + "] a: matrix 2400 must"));
    }
}
