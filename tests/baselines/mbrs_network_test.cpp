#include "mbrs_network.h"

#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("mbrs_network: a square message is the map itself, others pass through linear layers") {
  ParamStore<float> square, other;
  const MbrsNetwork<float> a(square, {.bits = 16, .channels = 4}, 1);
  CHECK_THROWS_AS(square.find("encoder/map/weight"), ValueError);
  CHECK(square.entry(square.find("encoder/message/conv/weight")).shape == Shape{3, 3, 1, 4});
  CHECK(square.entry(square.find("encoder/colour/weight")).shape == Shape{1, 1, 4 + 3, 3});
  const MbrsNetwork<float> b(other, {.bits = 8, .channels = 4}, 1);
  CHECK(other.entry(other.find("encoder/map/weight")).shape == Shape{8, 9});
  CHECK(other.entry(other.find("decoder/map/weight")).shape == Shape{9, 8});
}

TEST_CASE("mbrs_network: images of the map's size and of others") {
  for (const Index bits : {4, 8}) {
    ParamStore<float> store;
    const MbrsNetwork<float> net(store, {.bits = bits, .channels = 2}, 1);
    const Params<float> params(store, nullptr);
    for (const Shape& s : {Shape{2, 32, 32, 3}, Shape{1, 20, 45, 3}, Shape{1, 96, 64, 3}}) {
      CAPTURE(bits, s.str());
      Tape<float> tape;
      NormPass<float> pass;
      const auto images = uniform<float>(s, -1, 1, 1);
      const auto messages = uniform<float>({s[0], bits}, 0, 1, 2);
      const auto x = tape.constant(images);
      CHECK(net.encode(params, x, tape.constant(messages), pass).shape() == s);
      CHECK(net.decode(params, x, pass).shape() == Shape{s[0], bits});
    }
  }
}

TEST_CASE("mbrs_network: a bit is spread where its place on the map lies") {
  ParamStore<float> store;
  const MbrsNetwork<float> net(store, {.bits = 16, .channels = 4}, 1);
  const auto images = uniform<float>({1, 64, 64, 3}, -1, 1, 1);
  Tensor<float> messages({1, 16});
  const auto run = [&] {
    return op_values<float>(
        [&](auto&, auto v) {
          NormPass<float> pass{.running = true};
          return net.encode(Params<float>(store, nullptr), v[0], v[1], pass);
        },
        {images, messages});
  };
  const auto before = run();
  messages[0] = 1;  // upper left
  const auto after = run();
  double near = 0, far = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const std::size_t y = i / 3 / 64, x = i / 3 % 64;
    const double change = std::abs(static_cast<double>(after[i] - before[i]));
    if (y < 16 && x < 16) near += change;
    if (y >= 48 && x >= 48) far += change;
  }
  CHECK(near > 0);
  CHECK(far < near);  // squeeze-and-excitation is global, the map is local
}

TEST_CASE("mbrs_network: threads and errors") {
  ParamStore<float> store;
  const MbrsNetwork<float> net(store, {.bits = 4, .channels = 8}, 1);
  expect_same_bits(
      [&](auto&, auto v) {
        NormPass<float> pass;
        const Params<float> params(store, nullptr);
        return net.decode(params, net.encode(params, v[0], v[1], pass), pass);
      },
      {uniform<float>({2, 32, 32, 3}, -1, 1, 1), uniform<float>({2, 4}, 0, 1, 2)});
  Tape<float> tape;
  NormPass<float> pass;
  const Tensor<float> small({1, 15, 32, 3});
  CHECK_THROWS_WITH(net.decode(Params<float>(store, nullptr), tape.constant(small), pass),
                    "[mbrs_network] images must have at least 16 x 16 pixels, got shape [1, 15, 32, 3]");
}
