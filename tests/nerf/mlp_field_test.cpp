#include <fieldmark/nerf/field.h>

#include <algorithm>
#include <cmath>

#include "plain_field.h"
#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
constexpr MlpFieldOptions kSmallMlp{
    .layers = 3, .width = 6, .skip = 2, .position_bands = 3, .direction_bands = 2};
constexpr FieldOptions kField{.kind = FieldKind::mlp, .mlp = kSmallMlp};

Row gamma(const Row& p, int bands) {
  Row y = p;
  for (int b = 0; b < bands; ++b) {
    const double k = std::ldexp(3.14159265358979323846, b);
    for (const double v : p) y.push_back(std::sin(k * v));
    for (const double v : p) y.push_back(std::cos(k * v));
  }
  return y;
}

Row joined(Row a, const Row& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

// Returns sigma, red, green and blue at one position by plain loops over the named parameters.
Row reference(const ParamStore<double>& store, const double* x, const double* d) {
  const Row features = gamma({2 * x[0] - 1, 2 * x[1] - 1, 2 * x[2] - 1}, 3);
  Row h = layer(store, "density/1", layer(store, "density/0", features, true), true);
  h = layer(store, "density/2", joined(features, h), true);
  const Row z = layer(store, "density/3", h, false), feature = layer(store, "colour/0", h, false);
  const Row view = layer(store, "colour/1", joined(feature, gamma({d[0], d[1], d[2]}, 2)), true);
  Row out{std::exp(std::min(z[0], 15.0))};
  for (const double v : layer(store, "colour/2", view, false)) out.push_back(1 / (1 + std::exp(-v)));
  return out;
}
}  // namespace

TEST_CASE("mlp_field: equal to plain loops over its named parameters, within 1e-13") {
  ParamStore<double> store;
  const Field<double> field(store, kField, 1);
  randomise(store, 3);
  const auto x = uniform({20, 3}, 0, 1, 4), d = uniform({20, 3}, -1, 1, 5);
  Tape<double> tape;
  const auto out = field(Params<double>(store), tape.constant(x), tape.constant(d));
  CHECK(out.sigma.shape() == Shape{20});
  CHECK(out.rgb.shape() == Shape{20, 3});
  for (Index i = 0; i < 20; ++i) {
    const Row want = reference(store, x.data.data() + 3 * i, d.data.data() + 3 * i);
    CHECK(std::abs(out.sigma.value()[i] / want[0] - 1) < 1e-13);
    for (Index k = 0; k < 3; ++k)
      CHECK(std::abs(out.rgb.value()[3 * i + k] - want[static_cast<std::size_t>(k + 1)]) < 1e-13);
  }
}

TEST_CASE("mlp_field: its encoding of a block of positions equals the recorded op, bit by bit") {
  ParamStore<float> store;
  const MlpField<float> field(store, "", kSmallMlp, 1);
  for (const Index n : {0, 1, 31, 32, 33, 100}) {
    const auto x = uniform<float>({n, 3}, 0, 1, 4);
    std::vector<float> got(static_cast<std::size_t>(n * field.feature_width()));
    field.encode(x.data.data(), n, got.data());
    Tape<float> tape;
    const auto want = field.encode(tape.constant(x));
    CHECK(want.shape() == Shape{n, 21});
    CHECK(std::equal(got.begin(), got.end(), want.value()));
  }
}

TEST_CASE("mlp_field: the default has the layers of the original network") {
  ParamStore<float> store;
  const Field<float> field(store, {.kind = FieldKind::mlp}, 1);
  const auto shape = [&](const char* name) { return store.entry(store.find(name)).shape; };
  CHECK(shape("density/0/weight") == Shape{63, 256});
  CHECK(shape("density/4/weight") == Shape{256, 256});
  CHECK(shape("density/5/weight") == Shape{319, 256});
  CHECK(shape("density/7/weight") == Shape{256, 256});
  CHECK(shape("density/8/weight") == Shape{256, 1});
  CHECK(shape("colour/0/weight") == Shape{256, 256});
  CHECK(shape("colour/1/weight") == Shape{283, 128});
  CHECK(shape("colour/2/weight") == Shape{128, 3});
  CHECK(store.entries().size() == 24);
  CHECK(field.network_size() == store.size());
  CHECK_FALSE(field.has_table());
  CHECK(field.colour_width() == 0);
  CHECK(field.geometry_width() == 257);
  CHECK(field.direction_width() == 27);
  CHECK_THROWS_WITH(field.encoding(), Contains("expected a field with a hash table"));
}

TEST_CASE("mlp_field: colour layers do not reach the density") {
  ParamStore<double> store;
  const Field<double> field(store, kField, 1);
  randomise(store, 3);
  const auto x = uniform({20, 3}, 0, 1, 4);
  const auto sigma = [&] {
    Tape<double> tape;
    const auto out = field(Params<double>(store), tape.constant(x), tape.constant(x));
    return std::vector<double>(out.sigma.value(), out.sigma.value() + 20);
  };
  const auto before = sigma();
  int changed = 0;
  for (const auto& e : store.entries())
    if (Field<double>::is_colour(e.name)) {
      ++changed;
      for (double& v : store.values(store.find(e.name))) v += 1;
    }
  CHECK(changed == 6);
  CHECK(sigma() == before);
}

TEST_CASE("mlp_field: gradient in positions, directions and all parameters, skip or not") {
  for (const Index skip : {0, 2}) {
    FieldOptions options = kField;
    options.mlp.skip = skip;
    options.mlp.position_bands = 2;
    ParamStore<double> store;
    const Field<double> field(store, options, 1);
    // Weights that keep every ReLU open: finite differences must not step over its kink.
    const auto random = uniform({store.size()}, 0.02, 0.08, 3);
    std::copy(random.data.begin(), random.data.end(), store.values().begin());
    for (const char* name : {"density/0/bias", "density/1/bias", "density/2/bias", "colour/1/bias"})
      for (double& v : store.values(store.find(name))) v = 1;
    for (const Index n : {0, 1, 3})
      for (const bool colour : {false, true}) {
        const auto report = gradcheck_module(
            [&](auto&, const auto& params, auto v) {
              const auto out = field(params, v[0], v[1]);
              return colour ? out.rgb : out.sigma;
            },
            store, std::vector<Tensor<double>>{uniform({n, 3}, 0, 1, 7), uniform({n, 3}, -1, 1, 5)},
            {.step = 0.3});  // the highest band turns by 4 pi per cube side
        INFO(report.worst << "\n" << report.table);
        CHECK(report.ok);
      }
  }
}

TEST_CASE("mlp_field: errors name option and value") {
  ParamStore<float> store;
  const auto build = [&](MlpFieldOptions o) { const MlpField<float> built(store, "", o, 1); };
  CHECK_THROWS_WITH(build({.layers = 0}), "[mlp_field] layers must be 1 to 16, got 0");
  CHECK_THROWS_WITH(build({.width = 1}), "[mlp_field] width must be 2 to 1024, got 1");
  CHECK_THROWS_WITH(build({.layers = 4, .skip = 4}), "[mlp_field] skip must be 0 to 3, got 4");
  CHECK_THROWS_WITH(build({.position_bands = 21}), "[mlp_field] position_bands must be 1 to 20, got 21");
  CHECK_THROWS_WITH(build({.direction_bands = 0}), "[mlp_field] direction_bands must be 1 to 20, got 0");
}

TEST_CASE("mlp_field: the same bits for one and two threads") {
  ParamStore<float> store;
  const Field<float> field(store, kField, 1);
  randomise(store, 3);
  expect_same_for_threads(store, field);
}
