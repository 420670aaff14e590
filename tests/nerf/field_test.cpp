#include <fieldmark/nerf/field.h>
#include <fieldmark/nerf/spherical_harmonics.h>

#include <algorithm>
#include <cmath>

#include "plain_field.h"
#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr FieldOptions kSmallField{
    .encoding = {.levels = 2, .features = 2, .log2_table = 6, .base_resolution = 2, .finest_resolution = 5},
    .width = 5,
    .geometry = 3};

Tensor<double> unit_directions(Index n, unsigned seed) {
  auto d = uniform({n, 3}, -1, 1, seed);
  for (Index i = 0; i < n; ++i) {
    const double norm = std::hypot(d[3 * i], d[3 * i + 1], d[3 * i + 2]);
    for (int a = 0; a < 3; ++a) d[3 * i + a] /= norm;
  }
  return d;
}

// Returns sigma, red, green and blue at one position by plain loops over the named parameters.
Row reference(const ParamStore<double>& store, const Field<double>& field, const double* x, const double* d) {
  Row density(4), colour(4);
  field.encoding().encode(store.values(field.encoding().table()), x, 1, density.data(), colour.data());
  const Row z = layer(store, "density/1", layer(store, "density/0", density, true), false);
  Row h = z;
  h.insert(h.end(), colour.begin(), colour.end());
  Tape<double> tape;
  const auto y = spherical_harmonics(tape.constant(d, {1, 3}));
  h.insert(h.end(), y.value(), y.value() + kSphericalHarmonics);
  const Row rgb =
      layer(store, "colour/2", layer(store, "colour/1", layer(store, "colour/0", h, true), true), false);
  Row out{std::exp(std::min(z[0], 15.0))};
  for (const double v : rgb) out.push_back(1 / (1 + std::exp(-v)));
  return out;
}
}  // namespace

TEST_CASE("field: equal to plain loops over its named parameters, within 1e-14") {
  ParamStore<double> store;
  const Field<double> field(store, kSmallField, 1);
  randomise(store, 3);
  const auto x = uniform({20, 3}, 0, 1, 4), d = unit_directions(20, 5);
  Tape<double> tape;
  const auto out = field(Params<double>(store), tape.constant(x), tape.constant(d));
  CHECK(out.sigma.shape() == Shape{20});
  CHECK(out.rgb.shape() == Shape{20, 3});
  for (Index i = 0; i < 20; ++i) {
    const Row want = reference(store, field, x.data.data() + 3 * i, d.data.data() + 3 * i);
    CHECK(std::abs(out.sigma.value()[i] / want[0] - 1) < 1e-14);
    for (Index k = 0; k < 3; ++k)
      CHECK(std::abs(out.rgb.value()[3 * i + k] - want[static_cast<std::size_t>(k + 1)]) < 1e-14);
  }
}

TEST_CASE("field: colour features and colour layers do not reach the density") {
  ParamStore<double> store;
  const Field<double> field(store, kSmallField, 1);
  randomise(store, 3);
  const auto x = uniform({20, 3}, 0, 1, 4), d = unit_directions(20, 5);
  const auto sigma = [&] {
    Tape<double> tape;
    const auto out = field(Params<double>(store), tape.constant(x), tape.constant(d));
    return std::vector<double>(out.sigma.value(), out.sigma.value() + 20);
  };
  const auto before = sigma();
  for (const auto& e : store.entries())
    if (Field<double>::is_colour(e.name))
      for (double& v : store.values(store.find(e.name))) v += 1;
  const auto table = store.values(field.encoding().table());
  for (std::size_t i = 0; i < table.size(); ++i)
    if (i % 4 >= 2) table[i] += 1;
  CHECK(sigma() == before);
}

TEST_CASE("field: the store holds the networks first and the table last") {
  ParamStore<float> store;
  const Field<float> field(store, kSmallField, 1);
  std::vector<std::string> names;
  for (const auto& e : store.entries()) names.push_back(e.name);
  CHECK(names == std::vector<std::string>{"density/0/weight", "density/0/bias", "density/1/weight",
                                          "density/1/bias", "colour/0/weight", "colour/0/bias",
                                          "colour/1/weight", "colour/1/bias", "colour/2/weight",
                                          "colour/2/bias", "hash/table"});
  CHECK(store.entry(field.encoding().table()).offset == field.network_size());
  CHECK(Field<float>::is_colour("colour/1/bias"));
  CHECK_FALSE(Field<float>::is_colour("density/1/bias"));
}

TEST_CASE("field: gradient in positions, directions and all parameters") {
  ParamStore<double> store;
  const Field<double> field(store, kSmallField, 1);
  // Weights and biases that keep every ReLU open: finite differences must not step over its kink.
  const auto random = uniform({store.size()}, 0.05, 0.3, 3);
  std::copy(random.data.begin(), random.data.end(), store.values().begin());
  for (const char* name : {"density/0/bias", "colour/0/bias", "colour/1/bias"})
    for (double& v : store.values(store.find(name))) v = 3;
  for (const Index n : {0, 1, 3}) {
    Tensor<double> x(Shape{n, 3});
    for (Index i = 0; i < x.size(); ++i) x[i] = (static_cast<double>(i % 5) + 0.31) / 5;  // inside the cells
    for (const bool colour : {false, true}) {
      const auto report = gradcheck_module(
          [&](auto&, const auto& params, auto v) {
            const auto out = field(params, v[0], v[1]);
            return colour ? out.rgb : out.sigma;
          },
          store, std::vector<Tensor<double>>{x, unit_directions(n, 5)});
      INFO(report.worst << "\n" << report.table);
      CHECK(report.ok);
    }
  }
}

TEST_CASE("field: densities stay finite at any parameter size") {
  ParamStore<float> store;
  const Field<float> field(store, kSmallField, 1);
  for (float& v : store.values()) v = 1e4f;
  const auto x = uniform<float>({5, 3}, 0, 1, 4);
  Tape<float> tape;
  const auto out = field(Params<float>(store), tape.constant(x), tape.constant(x));
  for (Index i = 0; i < 5; ++i) CHECK(std::abs(out.sigma.value()[i] / std::exp(15.f) - 1) < 1e-6f);
}

TEST_CASE("field: errors name option and shape") {
  ParamStore<float> store;
  const auto build = [&](FieldOptions o) { const Field<float> built(store, o, 1); };
  CHECK_THROWS_WITH(build({.width = 0}), "[field] width must be 1 to 256, got 0");
  CHECK_THROWS_WITH(build({.geometry = 257}), "[field] geometry must be 1 to 256, got 257");
  CHECK_THROWS_AS(build({.encoding = {.levels = 0}}), ValueError);
  const Field<float> field(store, kSmallField, 1);
  CHECK_THROWS_AS(build(kSmallField), ValueError);  // the names are taken
  Tape<float> tape;
  const Tensor<float> x(Shape{2, 3}), wide(Shape{2, 4});
  CHECK_THROWS_WITH(field(Params<float>(store), tape.constant(wide), tape.constant(x)),
                    Contains("x: axis 1 must be 3"));
  CHECK_THROWS_WITH(field(Params<float>(store), tape.constant(x), tape.constant(wide)),
                    Contains("d: axis 1 must be 3"));
}

TEST_CASE("field: the same bits for one and two threads") {
  ParamStore<float> store;
  const Field<float> field(store, kSmallField, 1);
  randomise(store, 3);
  expect_same_for_threads(store, field);
}
