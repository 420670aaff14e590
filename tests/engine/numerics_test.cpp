#include <fieldmark/engine/numerics.h>
#include <fieldmark/engine/ops/arithmetic.h>

#include "support/catch.h"

using namespace fieldmark;

namespace {
constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::nan("");
}  // namespace

TEST_CASE("numerics: the worst error is relative to each number's scale, and NaN stays") {
  WorstError e;
  e.compare(1.5, 1, 2);
  CHECK(e.worst == 0.25);
  e.compare(100, 100.5, 1000);
  CHECK((e.worst == 0.25 && e.values == 2));
  e.compare(kInfinity, kInfinity, 1);
  CHECK(e.worst == 0.25);
  e.compare(1, kInfinity, 1);
  CHECK(e.worst == kInfinity);
  e.compare(kNan, 1, 1);
  e.compare(2, 1, 1);
  CHECK((std::isnan(e.worst) && e.values == 6));
}

TEST_CASE("numerics: equal takes in nothing for equal numbers and two NaNs, else infinity") {
  WorstError e;
  e.equal(0.1f, 0.1f);
  e.equal(kNan, kNan);
  CHECK(e.worst == 0);
  e.equal(0.1, 0.1f);
  CHECK(e.worst == kInfinity);
  WorstError one_nan;
  one_nan.equal(kNan, 0);
  CHECK(one_nan.worst == kInfinity);
}

TEST_CASE("numerics: a case passes within its limit, not with NaN and not with nothing compared") {
  const NumericsCase c{"c", "float", "value", 1e-6, [] { return WorstError{}; }};
  CHECK(c.ok({.worst = 1e-6, .values = 1}));
  CHECK_FALSE(c.ok({.worst = 2e-6, .values = 1}));
  CHECK_FALSE(c.ok({.worst = kNan, .values = 1}));
  CHECK_FALSE(c.ok({.worst = 0, .values = 0}));
}

TEST_CASE("numerics: one case becomes one in float and one in double") {
  std::vector<NumericsCase> cases;
  add_numerics(cases, "third", "value", 1e-7, 1e-15,
               [](auto zero, WorstError& e) { e.compare((zero + 1) / 3, 1 / 3.0L, 1 / 3.0L); });
  REQUIRE(cases.size() == 2);
  CHECK((cases[0].type == "float" && cases[1].type == "double"));
  for (const auto& c : cases) CHECK((c.ok(c.run()) && c.run().worst > 0));
}

TEST_CASE("numerics: scattered numbers lie in their range, differ, and follow the seed") {
  const auto a = scattered<float>({1000}, -2, 3, 1), b = scattered<float>({1000}, -2, 3, 1);
  CHECK(a.data == b.data);
  CHECK(a.data != scattered<float>({1000}, -2, 3, 2).data);
  double mean = 0;
  for (const float v : a.data) {
    CHECK((v >= -2 && v <= 3));
    mean += static_cast<double>(v) / 1000;
  }
  CHECK(std::abs(mean - 0.5) < 0.2);  // standard deviation of a mean of 1000: 0.046
}

TEST_CASE("numerics: values and gradients of one pass") {
  const std::vector<Tensor<double>> in{{{2}, {2, 3}}, {{2}, {5, 7}}};
  const auto got = values_and_gradients<double>([](auto&, const auto& v) { return mul(v[0], v[1]); }, in,
                                                [](Shape s) {
                                                  return Tensor<double>(s, {1, 10});
                                                });
  CHECK(got == std::vector<std::vector<double>>{{10, 21}, {5, 70}, {2, 30}});
}
