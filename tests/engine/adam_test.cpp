#include <fieldmark/core/error.h>
#include <fieldmark/engine/adam.h>
#include <fieldmark/engine/parallel.h>

#include <cmath>
#include <limits>
#include <vector>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;

namespace {

// A two-layer field with a table that starts on a cache line, and an extractor with running statistics.
ParamStore<double> some_store() {
  ParamStore<double> store;
  store.add("field/0/weight", {2, 3});
  store.add("field/0/bias", {3});
  store.add("field/table", {4096});
  store.add("extractor/0/weight", {4});
  store.add("extractor/0/running_mean", {4}, ParamRole::running);
  store.add("extractor/0/bias", {1});
  return store;
}

}  // namespace

TEST_CASE("adam: the first step is lr times the gradient's sign, whatever its size") {
  Adam<double> adam(4, {.lr = 0.5});
  std::vector<double> x{1, 1, 1, 1}, g{1e-2, -3, 1e20, 0};
  adam.step(x, g);
  // eps is 1e-8: a gradient of 1e-2 moves x by lr / (1 + 1e-6).
  CHECK(std::abs(x[0] - (1 - 0.5 / (1 + 1e-6))) < 1e-12);
  CHECK(std::abs(x[1] - (1 + 0.5 / (1 + 1e-8 / 3))) < 1e-12);
  CHECK(std::abs(x[2] - 0.5) < 1e-14);
  CHECK(x[3] == 1);
  CHECK(g == std::vector<double>{1e-2, -3, 1e20, 0});
  CHECK(adam.steps() == 1);
}

TEST_CASE("adam: several steps with betas and decay of their own follow the paper's algorithm") {
  const AdamOptions o{.lr = 0.03, .beta1 = 0.8, .beta2 = 0.999, .eps = 1e-3, .weight_decay = 0.2};
  Adam<double> adam(1, o);
  std::vector<double> x{2};
  double want = 2, m = 0, v = 0;
  for (int t = 1; t <= 50; ++t) {
    std::vector<double> g{std::sin(t)};
    adam.step(x, g, 1.0 / t);
    m = 0.8 * m + 0.2 * g[0];
    v = 0.999 * v + 0.001 * g[0] * g[0];
    const double lr = 0.03 / t;
    want -= lr * (m / (1 - std::pow(0.8, t)) / (std::sqrt(v / (1 - std::pow(0.999, t))) + 1e-3) + 0.2 * want);
  }
  // Rounding error of 50 steps.
  CHECK(std::abs(x[0] - want) < 1e-14);
}

TEST_CASE("adam: zero and tiny gradients keep everything finite, and a bad one spoils only its own entry") {
  Adam<float> adam(4);
  std::vector<float> x{1, 1, 1, 1};
  for (int t = 0; t < 20; ++t) {
    std::vector<float> g{0, 1e-30f, std::numeric_limits<float>::quiet_NaN(), 1e18f};
    adam.step(x, g);
  }
  CHECK(x[0] == 1);
  // 1e-30 squared is 0 in float: the step is lr 1e-30 / eps.
  CHECK(x[1] == 1);
  CHECK(std::isnan(x[2]));
  CHECK(std::abs(x[3] - 0.98f) < 1e-5f);
}

TEST_CASE("adam: skip_zero leaves value and moments, otherwise momentum moves on") {
  std::vector<float> still{1}, moves{1};
  Adam<float> skip(1, {.skip_zero = true, .weight_decay = 0.1}), plain(1);
  for (float first : {1.0f, 0.0f}) {
    std::vector<float> g{first};
    skip.step(still, g);
    plain.step(moves, g);
    if (first == 1.0f) CHECK(moves[0] > 0.9985f);
  }
  CHECK(skip.mean()[0] == 1.0f - 0.9f);
  CHECK(skip.mean_square()[0] == 1.0f - 0.999f);
  CHECK(std::abs(still[0] - (1 - 1e-3f - 1e-4f)) < 2e-7f);
  CHECK(moves[0] < 0.9985f);
}

TEST_CASE("adam: ranges have step sizes and rules of their own, what is in none stays") {
  Adam<double> adam(4, {.lr = 1, .zero_grads = true});
  std::vector<double> x{0, 0, 0, 5}, g{1, 1, 1, 0};
  const std::vector<AdamRange> ranges{{.begin = 0, .end = 1, .lr_factor = 0.25},
                                      {.begin = 2, .end = 2},
                                      {.begin = 2, .end = 4, .lr_factor = 0.5, .weight_decay = 0.1}};
  adam.step(x, g, ranges);
  CHECK(std::abs(x[0] + 0.25 / (1 + 1e-8)) < 1e-14);
  CHECK(x[1] == 0);
  CHECK(std::abs(x[2] + 0.5 / (1 + 1e-8)) < 1e-14);
  CHECK(std::abs(x[3] - 4.75) < 1e-14);
  CHECK(g == std::vector<double>{0, 1, 0, 0});
}

TEST_CASE("adam: a step taken range by range is the step taken at once") {
  const auto start = uniform<float>({200}, -1, 1, 1), g = uniform<float>({200}, -1, 1, 2);
  std::vector<float> x(start.data), y(start.data), dx(g.data), dy(g.data);
  Adam<float> whole(200, {.lr = 0.1}), parts(200, {.lr = 0.1});
  const AdamRange all{.begin = 0, .end = 200, .lr_factor = 0.5},
      first{.begin = 0, .end = 33, .lr_factor = 0.5}, rest{.begin = 33, .end = 200, .lr_factor = 0.5};
  CHECK_THROWS_WITH(parts.extend_step(y, dy, rest), "[Adam::extend_step] no step was taken before");
  for (int step = 0; step < 3; ++step) {
    whole.step(x, dx, std::span(&all, 1));
    parts.step(y, dy, std::span(&first, 1));
    parts.extend_step(y, dy, rest);
  }
  CHECK(x == y);
  CHECK(parts.steps() == 3);
  CHECK_THROWS_WITH(parts.extend_step(y, dy, {.begin = 3, .end = 201}), Contains("within [0, 200]"));
}

TEST_CASE("adam: made for a store, no step changes its running values, whatever the decay") {
  ParamStore<float> store;
  store.add("first", {3});
  const auto mean = store.add("mean", {5}, ParamRole::running), last = store.add("last", {40}),
             variance = store.add("variance", {2}, ParamRole::running);
  const AdamOptions options{.lr = 0.1, .weight_decay = 0.5, .zero_grads = true};
  Adam<float> adam(store, options), flat(store.size(), options);
  std::vector<float> all(at(store.size())), grads;
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = store.values()[i] = 1 + 0.1f * static_cast<float>(i);
  const std::vector<float> before = all;
  const auto fill = [&](std::span<float> g) {
    for (std::size_t i = 0; i < g.size(); ++i) g[i] = std::sin(static_cast<float>(i));
  };
  const AdamRange parts[] = {{.begin = 0, .end = 6, .lr_factor = 0.5, .weight_decay = 0.5},
                             {.begin = 6, .end = 50, .weight_decay = 0.5}};
  for (int step = 0; step < 3; ++step) {
    grads.resize(all.size());
    fill(store.grads());
    fill(grads);
    step == 1 ? adam.step(store.values(), store.grads(), parts) : adam.step(store.values(), store.grads());
    step == 1 ? flat.step(all, grads, parts) : flat.step(all, grads);
  }
  for (const auto& e : store.entries())
    for (Index i = e.offset; i < e.offset + e.shape.size(); ++i) {
      CAPTURE(e.name, i);
      CHECK(store.values()[at(i)] == (e.role == ParamRole::running ? before : all)[at(i)]);
    }
  CHECK(store.values(last)[0] != before[8]);
  CHECK((store.values(mean)[4] == before[7] && store.values(variance)[1] == before[49]));
}

TEST_CASE("adam: a resumed optimiser continues with the same bits, on any number of threads") {
  const Index n = 50001;
  auto grads = [&](int t) { return uniform<float>({n}, -1, 1, static_cast<unsigned>(t)).data; };
  auto run = [&](int n_threads, int stop) {
    const ScopedThreads scope(n_threads);
    std::vector<float> x(static_cast<std::size_t>(n), 1.0f);
    Adam<float> adam(n, {.skip_zero = true, .zero_grads = true});
    for (int t = 0; t < 6; ++t) {
      if (t == stop) {
        Adam<float> resumed(n, {.skip_zero = true, .zero_grads = true});
        std::copy(adam.mean().begin(), adam.mean().end(), resumed.mean().begin());
        std::copy(adam.mean_square().begin(), adam.mean_square().end(), resumed.mean_square().begin());
        resumed.set_steps(adam.steps());
        adam = resumed;
      }
      auto g = grads(t);
      adam.step(x, g, std::pow(0.1, t / 6.0));
    }
    return x;
  };
  const auto want = run(1, -1);
  CHECK(run(2, -1) == want);
  CHECK(run(2, 3) == want);
}

TEST_CASE("adam: empty, and errors") {
  Adam<float> empty(0);
  CHECK_NOTHROW(empty.step({}, {}));
  CHECK(empty.steps() == 1);
  Adam<float> adam(2);
  std::vector<float> two(2), three(3);
  CHECK_THROWS_WITH(adam.step(two, three),
                    "[Adam::step] grads must have 2 elements, as the optimiser, got 3");
  CHECK_THROWS_AS(adam.step(three, two), ShapeError);
  const std::vector<AdamRange> outside{{.begin = 1, .end = 3}};
  CHECK_THROWS_WITH(adam.step(two, two, outside),
                    "[Adam::step] ranges: each must lie within [0, 2], got [1, 3]");
  CHECK(adam.steps() == 0);
  CHECK_THROWS_WITH(Adam<float>(1, {.beta2 = 1}), "[Adam] beta2 must be in [0, 1), got 1");
  CHECK_THROWS_WITH(Adam<float>(-1), Contains("n must be at least 0"));
  CHECK_THROWS_WITH(Adam<double>(1, {.lr = std::nan("")}), Contains("lr must be positive"));
  CHECK_THROWS_WITH(adam.set_steps(-1), Contains("steps must be at least 0, got -1"));
}

TEST_CASE("adam: names choose ranges, the first group that matches counts, neighbours are one range") {
  const auto store = some_store();
  const auto ranges = adam_ranges(store, {{"extractor/*", {.lr_factor = 0.1}},
                                          {"*/table", {.begin = 7, .end = 9, .skip_zero = true}},
                                          {"*", {.weight_decay = 0.5}}});
  REQUIRE(ranges.size() == 4);
  const auto is = [&](std::size_t i, Index begin, Index end) {
    return ranges[i].begin == begin && ranges[i].end == end;
  };
  CHECK((is(0, 0, 9) && ranges[0].weight_decay == 0.5 && ranges[0].lr_factor == 1));
  CHECK((is(1, 16, 4112) && ranges[1].skip_zero && ranges[1].weight_decay == 0));
  CHECK((is(2, 4112, 4116) && ranges[2].lr_factor == 0.1 && !ranges[2].skip_zero));
  CHECK((is(3, 4120, 4121) && ranges[3].lr_factor == 0.1));
  CHECK(adam_ranges(store, {}).empty());
}

TEST_CASE("adam: a step moves the parameters of a group alone") {
  auto store = some_store();
  std::fill(store.grads().begin(), store.grads().end(), 1.0);
  Adam<double> adam(store, {.lr = 0.5});
  adam.step(store.values(), store.grads(), adam_ranges(store, {{"*/bias"}}));
  for (const auto& e : store.entries()) {
    CAPTURE(e.name);
    const double moved = store.values(store.find(e.name))[0];
    if (e.name.ends_with("/bias"))
      CHECK(std::abs(moved + 0.5) < 1e-7);
    else
      CHECK(moved == 0);
  }
}

TEST_CASE("adam: names that no trained parameter has are refused") {
  const auto store = some_store();
  CHECK_THROWS_WITH(adam_ranges(store, {{"*"}, {"extracter/*"}}),
                    "[adam_ranges] no trained parameter of the store has a name like 'extracter/*'");
  CHECK_THROWS_WITH(adam_ranges(store, {{"*/running_mean"}}), Contains("'*/running_mean'"));
  CHECK_THROWS_AS(adam_ranges(ParamStore<double>(), {{"*"}}), ValueError);
}
