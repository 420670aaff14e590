#include <fieldmark/nerf/hash_encoding.h>

#include <cmath>
#include <limits>

#include "hash_reference.h"
#include "nerf/plain_field.h"
#include "support/each_isa.h"
#include "support/expect_grad.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
using Part = HashEncoding<double>::Part;
constexpr HashEncodingOptions kSmall{
    .levels = 3, .features = 2, .log2_table = 6, .base_resolution = 2, .finest_resolution = 8};

// Computes both parts at one position, straight from the paper's formulas.
std::vector<double> reference(const HashEncoding<double>& encoding, std::span<const double> table,
                              Index table_size, const std::array<double, 3>& x, bool colour) {
  std::vector<double> y;
  Index first = 0;
  const Index features = encoding.features();
  for (int l = 0; l < encoding.levels(); ++l) {
    const Index n = encoding.resolution(l), corners = (n + 1) * (n + 1) * (n + 1);
    const bool hashed = corners > table_size;
    for (Index f = 0; f < features; ++f) {
      long double sum = 0;
      for (const auto& c : hash_corners(n, hashed ? table_size : 0, x))
        sum += c.weight * static_cast<long double>(table[static_cast<std::size_t>(
                              (first + c.row) * 2 * features + (colour ? features : 0) + f)]);
      y.push_back(static_cast<double>(sum));
    }
    first += hashed ? table_size : corners;
  }
  return y;
}

// Returns the largest difference from the reference over positions x, for values up to 1.
double worst_error(const HashEncodingOptions& options, const Tensor<double>& x) {
  ParamStore<double> store;
  const HashEncoding<double> encoding(store, "e", options, 1);
  randomise(store, 7);
  double worst = 0;
  for (const bool colour : {false, true}) {
    Tape<double> tape;
    const auto y = encoding(Params<double>(store), tape.constant(x), colour ? Part::colour : Part::density);
    for (Index i = 0; i < x.shape[0]; ++i) {
      const auto want = reference(encoding, store.values(encoding.table()), Index{1} << options.log2_table,
                                  {x[3 * i], x[3 * i + 1], x[3 * i + 2]}, colour);
      for (std::size_t k = 0; k < want.size(); ++k) {
        const double error = std::abs(y.value()[i * encoding.width() + static_cast<Index>(k)] - want[k]);
        raise_to(worst, error);
      }
    }
  }
  return worst;
}
}  // namespace

TEST_CASE("hash_encoding: resolutions of the paper's 16 levels from 16 to 512") {
  ParamStore<float> store;
  const HashEncoding<float> encoding(
      store, "e", {.levels = 16, .features = 2, .log2_table = 14, .finest_resolution = 512}, 1);
  const std::vector<Index> want{16, 20, 25, 32, 40, 50, 64, 80, 101, 128, 161, 203, 256, 322, 406, 512};
  for (int l = 0; l < 16; ++l) CHECK(encoding.resolution(l) == want[static_cast<std::size_t>(l)]);
  // 17^3 and 21^3 corners fit into 2^14 entries, 26^3 do not.
  CHECK(encoding.rows() == 17 * 17 * 17 + 21 * 21 * 21 + 14 * (1 << 14));
}

TEST_CASE("hash_encoding: equal to a brute-force hash with the published primes, within 1e-14") {
  CHECK(worst_error(kSmall, uniform({200, 3}, 0, 1, 2)) < 1e-14);
  CHECK(worst_error(
            {.levels = 2, .features = 4, .log2_table = 10, .base_resolution = 4, .finest_resolution = 300},
            uniform({200, 3}, 0, 1, 3)) < 1e-13);  // fractions lose 300 eps
}

TEST_CASE("hash_encoding: on cell faces, at the corners of the cube and outside of it") {
  Tensor<double> x(Shape{0, 3});
  for (const double a : {0.0, 0.5, 1.0, -0.25, 1.25, 1e-300, 1 - 0x1p-53})
    for (const double b : {0.0, 1.0, 0.5}) x.data.insert(x.data.end(), {a, b, 0.25, b, 0.25, a});
  x.shape = {x.size() / 3, 3};
  CHECK(worst_error(
            {.levels = 2, .features = 2, .log2_table = 6, .base_resolution = 4, .finest_resolution = 8}, x) <
        1e-14);
}

TEST_CASE("hash_encoding: a NaN or infinite position touches no other row and reads no foreign memory") {
  ParamStore<float> store;
  const HashEncoding<float> encoding(store, "e", kSmall, 1);
  each_isa([&] {
    auto x = uniform<float>({5, 3}, 0, 1, 4);
    Tape<float> tape;
    const auto clean = encoding(Params<float>(store), tape.constant(x), HashEncoding<float>::Part::density);
    auto bad = x;
    bad[3] = std::numeric_limits<float>::quiet_NaN();
    bad[7] = std::numeric_limits<float>::infinity();
    bad[11] = -3e38f;
    const auto y = encoding(Params<float>(store), tape.constant(bad), HashEncoding<float>::Part::density);
    const Index w = encoding.width();
    CHECK(std::isnan(y.value()[w]));
    CHECK(std::equal(y.value(), y.value() + w, clean.value()));
    CHECK(std::equal(y.value() + 4 * w, y.value() + 5 * w, clean.value() + 4 * w));
  });
}

TEST_CASE("hash_encoding: gradient in positions and table") {
  for (const int features : {2, 4})
    for (const Part part : {Part::density, Part::colour})
      for (const Index n : {0, 1, 5}) {
        ParamStore<double> store;
        HashEncodingOptions options = kSmall;
        options.features = features;
        const HashEncoding<double> encoding(store, "e", options, 1);
        randomise(store, 5);
        // Inside the cells of all levels (2, 4 and 8): finite differences must not step over a face.
        Tensor<double> x(Shape{n, 3});
        for (Index i = 0; i < x.size(); ++i) x[i] = (static_cast<double>(i * 5 % 8) + 0.35) / 8;
        const auto report =
            gradcheck_module([&](auto&, const auto& params, auto v) { return encoding(params, v[0], part); },
                             store, std::vector<Tensor<double>>{x});
        INFO(report.worst << "\n" << report.table);
        CHECK(report.ok);
      }
}

TEST_CASE("hash_encoding: encode writes what the two parts give") {
  ParamStore<float> store;
  const HashEncoding<float> encoding(store, "e", kSmall, 3);
  const auto x = uniform<float>({37, 3}, 0, 1, 6);
  std::vector<float> density(37 * 6), colour(37 * 6);
  encoding.encode(store.values(encoding.table()), x.data.data(), 37, density.data(), colour.data());
  Tape<float> tape;
  const Params<float> params(store);
  const auto d = encoding(params, tape.constant(x), HashEncoding<float>::Part::density);
  const auto c = encoding(params, tape.constant(x), HashEncoding<float>::Part::colour);
  CHECK(std::equal(density.begin(), density.end(), d.value()));
  CHECK(std::equal(colour.begin(), colour.end(), c.value()));
}

TEST_CASE("hash_encoding: initial numbers lie within 1e-4 and follow the seed") {
  ParamStore<float> a, b, c;
  const HashEncoding<float> ea(a, "e", kSmall, 1), eb(b, "e", kSmall, 1), ec(c, "e", kSmall, 2);
  for (const float v : a.values()) CHECK(std::abs(v) <= 1e-4f);
  CHECK(std::equal(a.values().begin(), a.values().end(), b.values().begin()));
  CHECK_FALSE(std::equal(a.values().begin(), a.values().end(), c.values().begin()));
}

TEST_CASE("hash_encoding: errors name option, shape and value") {
  ParamStore<float> store;
  const auto build = [&](HashEncodingOptions o) { const HashEncoding<float> built(store, "e", o, 1); };
  CHECK_THROWS_WITH(build({.levels = 0}), "[hash_encoding] levels must be 1 to 32, got 0");
  CHECK_THROWS_WITH(build({.features = 3}), "[hash_encoding] features must be 2 or 4, got 3");
  CHECK_THROWS_WITH(build({.log2_table = 25}), "[hash_encoding] log2_table must be 4 to 24, got 25");
  CHECK_THROWS_WITH(build({.base_resolution = 16, .finest_resolution = 8}),
                    Contains("1 <= base <= finest <= 65536, got base 16 and finest 8"));
  CHECK_THROWS_AS(build({.finest_resolution = std::nan("")}), ValueError);
  const HashEncoding<float> encoding(store, "e", kSmall, 1);
  Tape<float> tape;
  const Tensor<float> flat(Shape{6}), wide(Shape{2, 4});
  const auto run = [&](const Tensor<float>& x) {
    encoding(Params<float>(store), tape.constant(x), HashEncoding<float>::Part::density);
  };
  CHECK_THROWS_WITH(run(flat), "[hash_encoding] x must have rank 2 [N, 3], got shape [6]");
  CHECK_THROWS_WITH(run(wide), "[hash_encoding] x: axis 1 must be 3 (x, y, z), got shape [2, 4]");
}

TEST_CASE("hash_encoding: the same bits for one and two threads") {
  ParamStore<float> store;
  const HashEncoding<float> encoding(store, "e", kSmall, 1);
  randomise(store, 8);
  const auto op = [&](Tape<float>&, std::span<const Var<float>> v) {
    const Params<float> params(store);
    return encoding(params, v[0], HashEncoding<float>::Part::colour);
  };
  const auto table_gradient = [&](int threads) {
    const ScopedThreads scope(threads);
    store.zero_grad();
    const auto result = run_op<float>(op, {uniform<float>({5000, 3}, 0, 1, 9)});
    return std::pair{result, std::vector<float>(store.grads().begin(), store.grads().end())};
  };
  const auto one = table_gradient(1), two = table_gradient(2);
  CHECK(one == two);
}
