#include <fieldmark/core/error.h>
#include <fieldmark/watermark/mark/global_mark.h>
#include <fieldmark/watermark/mark/gradcheck_cases.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "support/catch.h"
#include "support/dense_by_loops.h"
#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
constexpr GlobalMarkOptions kSmall{.bits = 3, .message_features = 4, .colour_features = 5, .width = 6};

void append(Row& to, const Row& from) { to.insert(to.end(), from.begin(), from.end()); }

void append_encoded(Row& to, const Row& x, int bands) {
  append(to, x);
  for (int b = 0; b < bands; ++b) {
    for (double v : x) to.push_back(std::sin(std::numbers::pi * std::exp2(b) * v));
    for (double v : x) to.push_back(std::cos(std::numbers::pi * std::exp2(b) * v));
  }
}

Row by_loops(const ParamStore<double>& store, const GlobalMarkOptions& o, const Row& x, const Row& d,
             const Row& c, const Row& message) {
  Row in;
  if (o.colour_features > 0) {
    append_encoded(in, x, 10);
    if (!o.authors_code) append_encoded(in, d, 4);
    append(in, c);
    for (int k = 0; k < 4; ++k) in = layer(store, "mark/encode/" + std::to_string(k), in, k < 3);
  }
  append(in, o.message_features == 0
                 ? message
                 : layer(store, "mark/message/1", layer(store, "mark/message/0", message, true), true));
  if (o.authors_code) append_encoded(in, d, 4);
  append(in, c);
  for (int k = 0; k < 3; ++k) {
    if (o.authors_code && k < 2) {
      append(in, message);
      append(in, c);
    }
    in = layer(store, "mark/fuse/" + std::to_string(k), in, k < 2);
  }
  for (double& v : in) v = 1 / (1 + std::exp(-v));
  return in;
}

template <class T>
auto colour(const GlobalMark<T>& net, const ParamStore<T>& store) {
  return [&](auto&, auto v) { return net(Params<T>(store, nullptr), v[0], v[1], v[2], v[3]); };
}
}  // namespace

TEST_CASE(
    "global_mark: the colour is what its formula says, with a part left out and as in the authors' code "
    "too") {
  std::vector<GlobalMarkOptions> kinds(5, kSmall);
  kinds[1].message_features = 0;
  kinds[2].colour_features = 0;
  kinds[3].authors_code = kinds[4].authors_code = true;
  kinds[4].message_features = 0;
  for (const GlobalMarkOptions& options : kinds) {
    ParamStore<double> store;
    const GlobalMark<double> net(store, "mark", options, 7);
    const auto x = uniform({4, 3}, 0, 1, 1), d = uniform({4, 3}, -1, 1, 2),
               c = uniform({4, net.colour_inputs()}, 0, 1, 3);
    const Tensor<double> message({1, 3}, {1, -1, 1});
    const auto y = op_values(colour(net, store), std::vector{x, d, c, message});
    for (std::size_t i = 0; i < 4; ++i) {
      const auto row = [&](const Tensor<double>& t) {
        const auto begin = t.data.begin() + static_cast<long>(i) * t.shape[1];
        return Row(begin, begin + t.shape[1]);
      };
      const Row want = by_loops(store, options, row(x), row(d), row(c), message.data);
      for (std::size_t a = 0; a < 3; ++a) CHECK(y[3 * i + a] == Approx(want[a]).margin(1e-12));
    }
  }
}

TEST_CASE("global_mark: the layers of preset code have the widths of the authors' code") {
  ParamStore<float> store;
  const GlobalMark<float> net(store, "mark", {.bits = 16, .message_features = 128, .authors_code = true}, 1);
  const auto shape = [&](const char* layer) {
    return store.entry(store.find(std::string("mark/") + layer + "/weight")).shape;
  };
  CHECK(shape("encode/0") == Shape{63 + 4, 256});
  CHECK(shape("encode/3") == Shape{256, 256});
  CHECK(shape("message/0") == Shape{16, 128});
  CHECK(shape("message/1") == Shape{128, 128});
  CHECK(shape("fuse/0") == Shape{419 + 16, 256});
  CHECK(shape("fuse/1") == Shape{260 + 16, 128});
  CHECK(shape("fuse/2") == Shape{128, 3});
}

TEST_CASE("global_mark: gradients in position, direction, colour, message and parameters") {
  int found = 0;
  for (const GradcheckCase& c : gradcheck_cases()) {
    if (!c.name.starts_with("global_mark")) continue;
    ++found;
    const GradcheckReport r = c.run();
    INFO(r.table);
    CHECK(r.ok);
    CHECK(r.worst <= 1e-7);
    CHECK(r.entries > 80);
  }
  CHECK(found == 5);
}

TEST_CASE("global_mark: none and one position, one and two threads, float near double") {
  ParamStore<double> exact;
  ParamStore<float> store;
  const GlobalMark<double> net_double(exact, "mark", kSmall, 7);
  const GlobalMark<float> net(store, "mark", kSmall, 7);
  std::copy(store.values().begin(), store.values().end(), exact.values().begin());
  const auto either = [&](auto&, auto v) {
    if constexpr (std::is_same_v<std::decay_t<decltype(*v[0].value())>, float>)
      return net(Params<float>(store, nullptr), v[0], v[1], v[2], v[3]);
    else
      return net_double(Params<double>(exact, nullptr), v[0], v[1], v[2], v[3]);
  };
  const std::vector inputs{uniform<float>({700, 3}, 0, 1, 1), uniform<float>({700, 3}, -1, 1, 2),
                           uniform<float>({700, 3}, 0, 1, 3), Tensor<float>({1, 3}, 1)};
  expect_same_bits(either, inputs);
  CHECK(float_error(either, inputs) <
        2e-3);  // the finest band multiplies the rounding error of a position by 1600
  for (Index n : {0, 1}) {
    const Tensor<double> few({n, 3}, 0.5);
    CHECK(op_values(either, std::vector{few, few, few, Tensor<double>({1, 3}, 1)}).size() ==
          static_cast<std::size_t>(3 * n));
  }
}

TEST_CASE("global_mark: errors name what is wrong") {
  const auto make = [](const GlobalMarkOptions& o) {
    ParamStore<float> store;
    const GlobalMark<float> net(store, "mark", o, 1);
  };
  CHECK_THROWS_AS(make({.bits = 0}), ValueError);
  CHECK_THROWS_WITH(make({.bits = 0}),
                    Contains("[global_mark] bits, message_features, colour_features and width must be at "
                             "least 1, 0, 0 and 2, got 0, 256, 256 and 256"));
  CHECK_THROWS_AS(make({.position_bands = 0}), ValueError);
  CHECK_THROWS_AS(make({.width = 1}), ValueError);
  ParamStore<double> store;
  const GlobalMark<double> net(store, "mark", kSmall, 7);
  const Tensor<double> few({2, 3}, 0.5);
  const auto with = [&](const Tensor<double>& message) {
    op_values(colour(net, store), std::vector{few, few, few, message});
  };
  CHECK_THROWS_AS(with(Tensor<double>({1, 4}, 1)), ShapeError);
  CHECK_THROWS_WITH(with(Tensor<double>({3, 3}, 1)), Contains("[global_mark] message") && Contains("[3, 3]"));
  CHECK_THROWS_AS(with(Tensor<double>({0, 3}, 1)), ShapeError);
  const Tensor<double> one({1, 3}, 0.5), message({1, 3}, 1);
  CHECK_THROWS_WITH(op_values(colour(net, store), std::vector{few, one, few, message}),
                    Contains("[global_mark] d: axis 0 must be 2 (rows of x)"));
  CHECK_THROWS_WITH(op_values(colour(net, store), std::vector{few, few, one, message}),
                    Contains("[global_mark] c: axis 0 must be 2 (rows of x)"));
}

TEST_CASE("global_mark: each of several messages marks its own samples, as it would alone") {
  auto without_features = kSmall, code = kSmall;
  without_features.message_features = 0;
  code.authors_code = true;
  for (const GlobalMarkOptions& options : {kSmall, without_features, code}) {
    ParamStore<double> store;
    const GlobalMark<double> net(store, "mark", options, 7);
    const std::vector samples{uniform({6, 3}, 0, 1, 1), uniform({6, 3}, -1, 1, 2),
                              uniform({6, net.colour_inputs()}, 0, 1, 3)};
    const Tensor<double> messages({2, 3}, {1, -1, 1, -1, -1, 1});
    const auto part = [](const Tensor<double>& t, Index rows, Index m) {
      const Index size = rows * t.shape[1];
      return Tensor<double>({rows, t.shape[1]}, {t.data.begin() + m * size, t.data.begin() + (m + 1) * size});
    };
    auto inputs = samples;
    inputs.push_back(messages);
    const auto both = op_values(colour(net, store), inputs);
    for (Index m = 0; m < 2; ++m) {
      std::vector<Tensor<double>> of_message;
      for (const auto& t : samples) of_message.push_back(part(t, 3, m));
      of_message.push_back(part(messages, 1, m));
      const auto alone = op_values(colour(net, store), of_message);
      for (Index i = 0; i < 9; ++i) CHECK(both[at(9 * m + i)] == Approx(alone[at(i)]).epsilon(1e-12));
    }
  }
}
