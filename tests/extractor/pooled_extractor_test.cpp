#include <fieldmark/extractor/pooled_extractor.h>

#include <cmath>

#include "support/expect_grad.h"
#include "support/run_op.h"

using namespace fieldmark;
using extractor::PooledExtractor;

TEST_CASE("pooled_extractor: the released network's layers") {
  ParamStore<float> store;
  const PooledExtractor<float> net(store, "h", {.n_bits = 48}, 1);
  CHECK(store.entry(store.find("h/0/conv/weight")).shape == Shape{3, 3, 3, 64});
  for (int k = 1; k < 8; ++k)
    CHECK(store.entry(store.find("h/" + std::to_string(k) + "/conv/weight")).shape == Shape{3, 3, 64, 64});
  CHECK(store.entry(store.find("h/8/conv/weight")).shape == Shape{3, 3, 64, 48});
  CHECK(store.entry(store.find("h/linear/weight")).shape == Shape{48, 48});
  CHECK_THROWS_AS(store.find("h/9/conv/weight"), ValueError);
}

TEST_CASE("pooled_extractor: one layer by hand, on a patch of one size") {
  // Weights are 0 except at the window's centre: each channel is normalised, clamped at 0 and averaged.
  ParamStore<double> store;
  const PooledExtractor<double> net(store, "h", {.n_bits = 1, .layers = 1}, 1);
  const auto w = store.values(store.find("h/0/conv/weight"));
  std::ranges::fill(w, 0.0);
  w[4 * 3 + 1] = 3;  // green
  store.values(store.find("h/linear/weight"))[0] = 2;
  store.values(store.find("h/linear/bias"))[0] = -0.5;
  const auto x = uniform({1, 4, 5, 3}, 0, 1, 1);
  double mean = 0, variance = 0, pooled = 0;
  const auto value = [&](Index p) { return 3 * (2 * x[p * 3 + 1] - 1); };
  for (Index p = 0; p < 20; ++p) mean += value(p) / 20;
  for (Index p = 0; p < 20; ++p) variance += (value(p) - mean) * (value(p) - mean) / 20;
  for (Index p = 0; p < 20; ++p) pooled += std::max(0.0, (value(p) - mean) / std::sqrt(variance + 1e-5)) / 20;
  const auto got =
      op_values<double>([&](auto&, auto v) { return net(Params<double>(store, nullptr), v[0]); }, {x});
  REQUIRE(got.size() == 1);
  CHECK(got[0] == Approx(2 * pooled - 0.5).epsilon(1e-12));
}

TEST_CASE("pooled_extractor: any patch size, a batch or one image") {
  ParamStore<float> store;
  const PooledExtractor<float> net(store, "h", {.n_bits = 6, .channels = 8, .layers = 3}, 1);
  const Params<float> params(store, nullptr);
  for (const Shape& s : {Shape{1, 1, 1, 3}, Shape{1, 9, 13, 3}, Shape{4, 7, 5, 3}}) {
    CAPTURE(s.str());
    Tape<float> tape;
    const auto images = uniform<float>(s, 0, 1, 1);
    const auto x = tape.constant(images);
    CHECK(net(params, x).shape() == Shape{s[0], 6});
    CHECK(net.evaluate(params, x).shape() == Shape{s[0], 6});
  }
}

TEST_CASE("pooled_extractor: the mean of the pixels' logits is the image's") {
  ParamStore<double> store;
  const PooledExtractor<double> net(store, "h", {.n_bits = 3, .channels = 4, .layers = 2}, 1);
  CHECK(net.channels() == 4);
  const auto images = uniform({2, 6, 5, 3}, 0, 1, 1);
  Tape<double> tape;
  const Params<double> params(store, nullptr);
  const auto places = net.places(params, tape.constant(images));
  const auto want = net(params, tape.constant(images));
  CHECK(places.features.shape() == Shape{60, 4});
  REQUIRE(places.pixels.shape() == Shape{60, 3});
  REQUIRE(places.images.shape() == want.shape());
  for (Index i = 0; i < 2; ++i)
    for (Index b = 0; b < 3; ++b) {
      double mean = 0;
      for (Index p = 0; p < 30; ++p) mean += places.pixels.value()[(30 * i + p) * 3 + b] / 30;
      CHECK(mean == Approx(want.value()[3 * i + b]).epsilon(1e-12));
      CHECK(places.images.value()[3 * i + b] == want.value()[3 * i + b]);
    }
}

TEST_CASE("pooled_extractor: running statistics follow the batch's, then an image is read alone") {
  ParamStore<double> store;
  const PooledExtractor<double> net(store, "h", {.n_bits = 3, .channels = 4, .layers = 2}, 1);
  const Params<double> params(store, nullptr);
  const auto view_images = uniform({2, 6, 5, 3}, 0, 1, 1);
  const Tensor<double> first({1, 6, 5, 3}, {view_images.data.begin(), view_images.data.begin() + 90});
  Tape<double> tape;
  std::vector<BatchStatistics> seen;
  const auto batch = net(params, tape.constant(view_images), &seen);
  CHECK(seen.size() == 2);
  net.update(store, seen, 1);
  const auto running = net.evaluate(params, tape.constant(view_images));
  const auto alone = net.evaluate(params, tape.constant(first));
  const auto own = net(params, tape.constant(first));
  for (std::size_t b = 0; b < 3; ++b) {
    CHECK(running.value()[b] == Approx(batch.value()[b]).epsilon(1e-10));
    CHECK(alone.value()[b] == Approx(batch.value()[b]).epsilon(1e-10));
    CHECK(std::abs(own.value()[b] - batch.value()[b]) > 1e-6);
  }
}

TEST_CASE("pooled_extractor: gradient in images and every parameter") {
  ParamStore<double> store;
  const PooledExtractor<double> net(store, "h", {.n_bits = 2, .channels = 3, .layers = 2}, 1);
  // ReLUs are well open or shut: finite differences must not step over a kink.
  for (const auto& e : store.entries())
    if (e.name.ends_with("/beta"))
      for (Index i = 0; i < e.shape.size(); ++i)
        store.values()[static_cast<std::size_t>(e.offset + i)] = i % 2 == 0 ? 20 : -20;
  const std::vector<Tensor<double>> in{uniform({2, 4, 3, 3}, 0, 1, 1)};
  const auto r = gradcheck_module([&](auto&, const auto& p, auto v) { return net(p, v[0]); }, store, in);
  INFO(r.table);
  CHECK(r.ok);
}

TEST_CASE("pooled_extractor: the same bits on one and two threads") {
  ParamStore<float> store;
  const PooledExtractor<float> net(store, "h", {.n_bits = 8, .channels = 16, .layers = 3}, 1);
  expect_same_bits([&](auto&, auto v) { return net(Params<float>(store, nullptr), v[0]); },
                   {uniform<float>({1, 90, 70, 3}, 0, 1, 1)});
}

TEST_CASE("pooled_extractor: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH((PooledExtractor<float>(store, "h", {.n_bits = 0}, 1)),
                    "[PooledExtractor] n_bits, channels and layers must be at least 1, got 0, 64 and 9");
  const PooledExtractor<float> net(store, "h", {.n_bits = 2, .channels = 4, .layers = 2}, 1);
  Tape<float> tape;
  const Tensor<float> flat({5, 5, 3}), grey({1, 5, 5, 1});
  CHECK_THROWS_WITH(
      net(Params<float>(store), tape.constant(flat)),
      "[PooledExtractor] images must have rank 4 [images, height, width, 3], got shape [5, 5, 3]");
  CHECK_THROWS_WITH(net.evaluate(Params<float>(store), tape.constant(grey)),
                    "[PooledExtractor] images: axis 3 must be 3 (red, green, blue), got shape [1, 5, 5, 1]");
  CHECK_THROWS_WITH(net.update(store, {}, 0.1),
                    "[PooledExtractor] batch must have one entry for each of the 2 layers, got 0");
}
