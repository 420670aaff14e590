#include <fieldmark/extractor/dense_extractor.h>

#include <fieldmark/engine/parallel.h>

#include <array>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using extractor::DenseExtractor;

namespace {

struct Reading {
  std::vector<float> sign, index, grads;
  bool operator==(const Reading&) const = default;
};

// Runs the forward pass, and computes the parameters' gradient from all-ones seeds.
Reading read(const DenseExtractor<float>& net, const ParamStore<float>& store, const Tensor<float>& image) {
  Reading r;
  r.grads.resize(static_cast<std::size_t>(store.size()));
  Tape<float> tape;
  const auto out = net(Params<float>(store, r.grads.data()), tape.constant(image));
  r.sign.assign(out.sign.value(), out.sign.value() + out.sign.shape().size());
  r.index.assign(out.index.value(), out.index.value() + out.index.shape().size());
  std::fill_n(out.sign.grad_acc(), out.sign.shape().size(), 1.f);
  std::fill_n(out.index.grad_acc(), out.index.shape().size(), 1.f);
  tape.replay();
  return r;
}

}  // namespace

TEST_CASE("dense_extractor: places are a quarter of the image, whatever its size") {
  ParamStore<float> store;
  const DenseExtractor<float> net(store, "net", {.classes = 4, .base = 8}, 3);
  for (const auto& [h, w] : {std::array<Index, 2>{16, 16}, {17, 31}, {19, 22}, {33, 50}, {64, 47}}) {
    CAPTURE(h, w);
    Tape<float> tape;
    const auto image = uniform<float>({1, h, w, 3}, 0, 1, 1);
    const auto out = net(Params<float>(store, nullptr), tape.constant(image));
    CHECK(out.height == h / 4);
    CHECK(out.width == w / 4);
    CHECK(out.sign.shape() == Shape{(h / 4) * (w / 4)});
    CHECK(out.index.shape() == Shape{(h / 4) * (w / 4), 4});
  }
}

TEST_CASE("dense_extractor: an odd last row and column are not looked at") {
  ParamStore<float> store;
  const DenseExtractor<float> net(store, "net", {.classes = 3, .base = 8}, 3);
  const auto even = uniform<float>({1, 18, 20, 3}, 0, 1, 1);
  Tensor<float> odd({1, 19, 21, 3}, 0.7f);
  for (Index i = 0; i < 18; ++i)
    for (Index j = 0; j < 60; ++j) odd[i * 63 + j] = even[i * 60 + j];
  CHECK(read(net, store, even) == read(net, store, odd));
}

TEST_CASE("dense_extractor: a place knows where it is, near and far") {
  // Changing one pixel moves its own place or a neighbour most, and through the coarse levels every place.
  ParamStore<double> store;
  const DenseExtractor<double> net(store, "net", {.classes = 5, .base = 8}, 3);
  auto image = uniform({1, 32, 32, 3}, 0.4, 0.6, 1);
  const auto signs = [&] {
    Tape<double> tape;
    const auto out = net(Params<double>(store, nullptr), tape.constant(image));
    return std::vector<double>(out.index.value(), out.index.value() + out.index.shape().size());
  };
  const auto before = signs();
  for (Index c = 0; c < 3; ++c) image[(13 * 32 + 22) * 3 + c] = 1;  // place (3, 5)
  const auto after = signs();
  std::vector<double> change(64);
  for (std::size_t p = 0; p < 64; ++p)
    for (std::size_t c = 0; c < 5; ++c) change[p] += std::abs(after[p * 5 + c] - before[p * 5 + c]);
  const auto most = std::max_element(change.begin(), change.end()) - change.begin();
  CHECK(std::abs(most / 8 - 3) <= 1);
  CHECK(std::abs(most % 8 - 5) <= 1);
  CHECK(*std::min_element(change.begin(), change.end()) > 0);
}

TEST_CASE("dense_extractor: every parameter takes part, and has a name below the network's") {
  ParamStore<float> store;
  const DenseExtractor<float> net(store, "net", {.classes = 6, .base = 16}, 3);
  const Reading r = read(net, store, uniform<float>({1, 32, 48, 3}, 0, 1, 1));
  for (const auto& e : store.entries()) {
    CAPTURE(e.name);
    CHECK(e.name.starts_with("net/"));
    const auto first = r.grads.begin() + e.offset;
    CHECK(std::any_of(first, first + e.shape.size(), [](float g) { return g != 0; }));
  }
  CHECK(store.entry(store.find("net/down0/conv/weight")).shape == Shape{3, 3, 12, 16});
  CHECK(store.entry(store.find("net/up1/conv/weight")).shape == Shape{3, 3, 80, 32});
}

TEST_CASE("dense_extractor: the same bits alone, beside another image, on one and two threads") {
  ParamStore<float> store;
  const DenseExtractor<float> net(store, "net", {.classes = 40, .base = 16}, 3);
  const std::array<Tensor<float>, 2> images{uniform<float>({1, 100, 90, 3}, 0, 1, 1),
                                            uniform<float>({1, 61, 70, 3}, 0, 1, 2)};
  const ScopedThreads serial(1);
  const std::array<Reading, 2> one{read(net, store, images[0]), read(net, store, images[1])};
  const ScopedThreads parallel(2);
  CHECK(read(net, store, images[0]) == one[0]);
  std::array<Reading, 2> together;
  parallel_for(2, 1, [&](Index i, Index) {
    const auto k = static_cast<std::size_t>(i);
    together[k] = read(net, store, images[k]);
  });
  CHECK(together == one);
}

TEST_CASE("dense_extractor: seeds decide the weights") {
  ParamStore<float> a, b, c;
  DenseExtractor<float>(a, "net", {.classes = 3, .base = 8}, 3);
  DenseExtractor<float>(b, "net", {.classes = 3, .base = 8}, 3);
  DenseExtractor<float>(c, "net", {.classes = 3, .base = 8}, 4);
  CHECK(std::ranges::equal(a.values(), b.values()));
  CHECK(!std::ranges::equal(a.values(), c.values()));
  // Layers of the same shape start with different weights.
  CHECK(!std::ranges::equal(a.values(a.find("net/down6/conv/weight")),
                            a.values(a.find("net/down7/conv/weight"))));
}

TEST_CASE("dense_extractor: errors") {
  ParamStore<float> store;
  CHECK_THROWS_WITH((DenseExtractor<float>(store, "a", {.classes = 1}, 1)),
                    "[DenseExtractor] classes must be at least 2 (a cell and the background), got 1");
  CHECK_THROWS_WITH((DenseExtractor<float>(store, "b", {.classes = 2, .base = 12}, 1)),
                    "[DenseExtractor] base must be a positive multiple of 8, got 12");
  const DenseExtractor<float> net(store, "net", {.classes = 3, .base = 8}, 1);
  CHECK_THROWS_AS((DenseExtractor<float>(store, "net", {.classes = 3, .base = 8}, 1)), ValueError);
  const Params<float> params(store);
  Tape<float> tape;
  const Tensor<float> flat({20, 20, 3}), two({2, 20, 20, 3}), grey({1, 20, 20, 1}), low({1, 15, 20, 3});
  CHECK_THROWS_WITH(net(params, tape.constant(flat)),
                    "[DenseExtractor] image must have rank 4 [1, height, width, 3], got shape [20, 20, 3]");
  CHECK_THROWS_WITH(net(params, tape.constant(two)),
                    "[DenseExtractor] image: axis 0 must be 1 (one image a pass), got shape [2, 20, 20, 3]");
  CHECK_THROWS_WITH(net(params, tape.constant(grey)),
                    "[DenseExtractor] image: axis 3 must be 3 (red, green, blue), got shape [1, 20, 20, 1]");
  CHECK_THROWS_WITH(
      net(params, tape.constant(low)),
      "[DenseExtractor] image: height and width must be at least 16 (four levels), got shape [1, 15, 20, 3]");
}
