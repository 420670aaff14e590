#include "hiding_network.h"

#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

std::vector<float> encoded(const HidingNetwork<float>& net, const ParamStore<float>& store,
                           const Tensor<float>& images, const Tensor<float>& messages) {
  return op_values<float>(
      [&](auto&, auto v) {
        NormPass<float> pass{.running = true};
        return net.encode(Params<float>(store, nullptr), v[0], v[1], pass);
      },
      {images, messages});
}

}  // namespace

TEST_CASE("hiding_network: HiDDeN's layers") {
  ParamStore<float> store;
  const HiddenNetwork<float> net(store, {.bits = 30}, 1);
  CHECK(store.entry(store.find("encoder/0/conv/weight")).shape == Shape{3, 3, 3, 64});
  CHECK(store.entry(store.find("encoder/3/conv/weight")).shape == Shape{3, 3, 64, 64});
  CHECK(store.entry(store.find("encoder/4/conv/weight")).shape == Shape{3, 3, 64 + 3 + 30, 64});
  CHECK(store.entry(store.find("encoder/colour/weight")).shape == Shape{1, 1, 64, 3});
  CHECK(store.entry(store.find("decoder/6/conv/weight")).shape == Shape{3, 3, 64, 64});
  CHECK(store.entry(store.find("decoder/7/conv/weight")).shape == Shape{3, 3, 64, 30});
  CHECK(store.entry(store.find("decoder/linear/weight")).shape == Shape{30, 30});
  const Discriminator<float> critic(store, {}, 1);
  CHECK(store.entry(store.find("discriminator/2/conv/weight")).shape == Shape{3, 3, 64, 64});
  CHECK_THROWS_AS(store.find("discriminator/3/conv/weight"), ValueError);
}

TEST_CASE("hiding_network: any size of images, and a bit changes its own image alone") {
  ParamStore<float> store;
  const HiddenNetwork<float> net(store, {.bits = 3, .channels = 4}, 1);
  const auto images = uniform<float>({2, 9, 7, 3}, -1, 1, 1);
  Tensor<float> messages({2, 3});
  const auto before = encoded(net, store, images, messages);
  messages[4] = 1;  // of the second image
  const auto after = encoded(net, store, images, messages);
  REQUIRE(before.size() == 2 * 9 * 7 * 3);
  for (std::size_t i = 0; i < before.size() / 2; ++i) CHECK(before[i] == after[i]);
  CHECK(before != after);
  Tape<float> tape;
  NormPass<float> pass;
  const auto x = tape.constant(images);
  CHECK(net.decode(Params<float>(store, nullptr), x, pass).shape() == Shape{2, 3});
  ParamStore<float> other;
  const Discriminator<float> critic(other, {.channels = 4}, 1);
  CHECK(critic(Params<float>(other, nullptr), x, pass).shape() == Shape{2});
}

TEST_CASE("hiding_network: threads and errors") {
  ParamStore<float> store;
  const HiddenNetwork<float> net(store, {.bits = 3, .channels = 8}, 1);
  expect_same_bits(
      [&](auto&, auto v) {
        NormPass<float> pass;
        const Params<float> params(store, nullptr);
        return net.decode(params, net.encode(params, v[0], v[1], pass), pass);
      },
      {uniform<float>({2, 17, 19, 3}, -1, 1, 1), uniform<float>({2, 3}, 0, 1, 2)});
  Tape<float> tape;
  NormPass<float> pass;
  const Params<float> params(store, nullptr);
  const Tensor<float> x({2, 8, 8, 3}), few({1, 3}), grey({2, 8, 8, 1});
  CHECK_THROWS_WITH(net.encode(params, tape.constant(x), tape.constant(few), pass),
                    "[hidden_network] messages: axis 0 must be 2 (one for each image), got shape [1, 3]");
  CHECK_THROWS_WITH(net.decode(params, tape.constant(grey), pass),
                    "[hidden_network] images: axis 3 must be 3 (red, green, blue), got shape [2, 8, 8, 1]");
  CHECK_THROWS_WITH((HiddenNetwork<float>(store, {.bits = 0}, 1)),
                    "[hiding_network] bits and channels must be at least 1, got 0 and 64");
}
