#include <fieldmark/engine/tensor_stats.h>

#include <cmath>
#include <limits>

#include "support/catch.h"

using namespace fieldmark;

namespace {

template <class T>
TensorStats of(const std::vector<T>& x) {
  return tensor_stats("x", std::span<const T>(x));
}

template <class T>
void check_known() {
  const TensorStats s = of(std::vector<T>{1, -7, 0, 0, 5, 1, -0.f, 2});
  CHECK(s.name == "x");
  CHECK((s.count == 8 && s.zeros == 3 && s.nonfinite == 0));
  CHECK(s.mean == Approx(0.25).epsilon(1e-15));
  CHECK(s.rms == Approx(std::sqrt(10.0)).epsilon(1e-15));
  CHECK(s.largest == 7);
  CHECK(s.zero_fraction() == 0.375);
}

template <class T>
void check_nonfinite() {
  constexpr T nan = std::numeric_limits<T>::quiet_NaN(), inf = std::numeric_limits<T>::infinity();
  const TensorStats s = of(std::vector<T>{nan, 3, inf, -inf, -5, 0});
  CHECK((s.count == 6 && s.zeros == 1 && s.nonfinite == 3));
  CHECK(s.mean == Approx(-2 / 3.0).epsilon(1e-15));
  CHECK(s.rms == Approx(std::sqrt(34 / 3.0)).epsilon(1e-15));
  CHECK(s.largest == 5);
  const TensorStats none = of(std::vector<T>{nan, inf});
  CHECK((none.count == 2 && none.nonfinite == 2 && none.zeros == 0));
  CHECK((none.mean == 0 && none.rms == 0 && none.largest == 0));
}

template <class T>
void check_ends() {
  constexpr T top = std::numeric_limits<T>::max(), tiny = std::numeric_limits<T>::denorm_min();
  TensorStats s = of(std::vector<T>{top, top, top, -top});
  CHECK((s.mean == static_cast<double>(top) / 2 && s.rms == static_cast<double>(top)));
  CHECK((s.largest == static_cast<double>(top) && s.nonfinite == 0));
  s.merge(of(std::vector<T>{top, top, top, -top}));
  CHECK(s.mean == Approx(static_cast<double>(top) / 2).epsilon(1e-15));
  CHECK(s.rms == Approx(static_cast<double>(top)).epsilon(1e-15));
  const TensorStats t = of(std::vector<T>{tiny, tiny});
  CHECK((t.mean == static_cast<double>(tiny) && t.rms == static_cast<double>(tiny) && t.zeros == 0));
}

}  // namespace

TEST_CASE("tensor_stats: known numbers") {
  check_known<float>();
  check_known<double>();
}

TEST_CASE("tensor_stats: NaN and infinities are counted and stay out of the rest") {
  check_nonfinite<float>();
  check_nonfinite<double>();
}

TEST_CASE("tensor_stats: at the ends of the range nothing overflows or vanishes") {
  check_ends<float>();
  check_ends<double>();
}

TEST_CASE("tensor_stats: of nothing and of zeros") {
  const TensorStats none = of(std::vector<double>{});
  CHECK((none.count == 0 && none.zero_fraction() == 0 && none.mean == 0 && none.rms == 0));
  const TensorStats zeros = of(std::vector<float>(5, 0.f));
  CHECK((zeros.count == 5 && zeros.zero_fraction() == 1 && zeros.rms == 0 && zeros.largest == 0));
}

TEST_CASE("tensor_stats: merged, they are those of all elements") {
  const double nan = std::nan("");
  const std::vector<double> a{1, 0, nan, -9}, b{4, 0, 0, 2, nan, 6, nan};
  std::vector<double> all = a;
  all.insert(all.end(), b.begin(), b.end());
  TensorStats s = of(a);
  s.merge(of(b));
  const TensorStats want = of(all);
  CHECK((s.count == want.count && s.zeros == want.zeros && s.nonfinite == want.nonfinite));
  CHECK(s.mean == Approx(want.mean).epsilon(1e-14));
  CHECK(s.rms == Approx(want.rms).epsilon(1e-14));
  CHECK(s.largest == 9);
  // If one side has no finite numbers, the merge keeps the figures of the other.
  s.merge(of(std::vector<double>{nan}));
  CHECK((s.largest == 9 && s.rms == Approx(want.rms).epsilon(1e-14) && s.nonfinite == 4));
  TensorStats empty;
  empty.merge(of(a));
  CHECK((empty.rms == of(a).rms && empty.mean == of(a).mean && empty.count == 4));
  TensorStats nothing;
  nothing.merge(of(std::vector<double>{}));
  CHECK((nothing.count == 0 && nothing.mean == 0 && nothing.rms == 0));
}

TEST_CASE("tensor_stats: a store's tensors by name, of which running ones have no gradient") {
  ParamStore<float> store;
  const ParamId w = store.add("net/w", {2, 2}), m = store.add("net/mean", {2}, ParamRole::running),
                b = store.add("net/b", {3});
  store.values(w)[3] = 8;
  store.values(m)[0] = -6;
  store.grads(w)[0] = 4;
  store.grads(b)[1] = std::nanf("");
  store.grads(b)[2] = -3;
  const auto grads = gradient_stats(store);
  REQUIRE(grads.size() == 2);
  CHECK((grads[0].name == "net/w" && grads[0].count == 4 && grads[0].mean == 1 && grads[0].rms == 2));
  CHECK((grads[1].name == "net/b" && grads[1].nonfinite == 1 && grads[1].mean == -1.5));
  const auto values = value_stats(store);
  REQUIRE(values.size() == 3);
  CHECK((values[0].largest == 8 && values[0].rms == 4 && values[0].zeros == 3));
  CHECK((values[1].name == "net/mean" && values[1].mean == -3));
  CHECK(values[2].zero_fraction() == 1);
}

TEST_CASE("tensor_stats: as a table") {
  const std::vector<TensorStats> stats{of(std::vector<double>{3, -3, 0, 0, std::nan("")}),
                                       {.name = "a/name/longer/than/the/column", .count = 12}};
  CHECK(
      stats_table(stats) ==
      "name                            elements        mean         rms     largest   zero %  not finite\n"
      "x                                      5   0.000e+00   2.121e+00   3.000e+00    40.00           1\n"
      "a/name/longer/than/the/column         12   0.000e+00   0.000e+00   0.000e+00     0.00           0\n");
}
