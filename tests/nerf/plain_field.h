#pragma once
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/field.h>

#include <algorithm>
#include <string>
#include <vector>

#include "support/catch.h"
#include "support/dense_by_loops.h"
#include "support/random.h"
#include "support/run_op.h"

/// Sets every parameter of a store to a random number in [-1, 1).
template <class T>
void randomise(fieldmark::ParamStore<T>& store, unsigned seed) {
  const auto random = uniform<T>({store.size()}, -1, 1, seed);
  std::copy(random.data.begin(), random.data.end(), store.values().begin());
}

/// Checks that colours and gradients of a field have the same bits with one and two threads.
/// @param store  what `field` is in
inline void expect_same_for_threads(fieldmark::ParamStore<float>& store,
                                    const fieldmark::nerf::Field<float>& field) {
  using namespace fieldmark;
  std::vector<float> grads[2];
  std::vector<std::vector<float>> results[2];
  for (int n = 1; n <= 2; ++n) {
    const ScopedThreads scope(n);
    store.zero_grad();
    results[n - 1] = run_op<float>([&](auto&, auto v) { return field(Params<float>(store), v[0], v[1]).rgb; },
                                   {uniform<float>({3000, 3}, 0, 1, 4), uniform<float>({3000, 3}, -1, 1, 5)});
    grads[n - 1].assign(store.grads().begin(), store.grads().end());
  }
  CHECK(results[0] == results[1]);
  CHECK(grads[0] == grads[1]);
}
