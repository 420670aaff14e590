#pragma once
#include <fieldmark/engine/parallel.h>
#include <fieldmark/nerf/field.h>

#include <vector>

#include "support/catch.h"
#include "support/random.h"
#include "support/run_op.h"

/// Colours and gradients of a field are the same bits for one and two threads. @param store  what `field` is
/// in
inline void expect_same_for_threads(fieldmark::ParamStore<float>& store,
                                    const fieldmark::nerf::Field<float>& field) {
  using namespace fieldmark;
  std::vector<float> grads[2];
  std::vector<std::vector<float>> results[2];
  const int before = threads();
  for (int n = 1; n <= 2; ++n) {
    set_threads(n);
    store.zero_grad();
    results[n - 1] = run_op<float>([&](auto&, auto v) { return field(Params<float>(store), v[0], v[1]).rgb; },
                                   {uniform<float>({3000, 3}, 0, 1, 4), uniform<float>({3000, 3}, -1, 1, 5)});
    grads[n - 1].assign(store.grads().begin(), store.grads().end());
  }
  set_threads(before);
  CHECK(results[0] == results[1]);
  CHECK(grads[0] == grads[1]);
}
