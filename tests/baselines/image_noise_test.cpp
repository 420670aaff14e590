#include "image_noise.h"
#include <fieldmark/imaging/image.h>
#include "simulated_jpeg.h"

#include <algorithm>
#include <set>
#include <vector>

#include "support/run_op.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

const Tensor<float> kMarked = uniform<float>({2, 16, 24, 3}, -1, 1, 1),
                    kPlain = uniform<float>({2, 16, 24, 3}, -1, 1, 2);

std::vector<float> through(NoiseLayer layer, std::uint64_t step = 3) {
  return op_values<float>(
      [&](auto&, auto v) { return apply_noise_layer(layer, v[0], v[1], CounterRng(4), step); },
      {kMarked, kPlain});
}

// Marks the pixels that come from the marked image; all others must come from the plain one.
std::vector<bool> marked_pixels(const std::vector<float>& y) {
  std::vector<bool> marked;
  for (std::size_t p = 0; p < y.size() / 3; ++p) {
    const auto same = [&](const Tensor<float>& x) {
      return std::abs(y[3 * p] - x.data[3 * p]) < 1e-6f && std::abs(y[3 * p + 2] - x.data[3 * p + 2]) < 1e-6f;
    };
    REQUIRE((same(kMarked) || same(kPlain)));
    marked.push_back(same(kMarked));
  }
  return marked;
}

}  // namespace

TEST_CASE("image_noise: dropout and cropout show pixels of either image") {
  double least = 1, most = 0, smallest_window = 1;
  std::set<std::vector<bool>> windows;
  for (std::uint64_t step = 0; step < 12; ++step) {
    const auto dropped = marked_pixels(through(NoiseLayer::dropout, step));
    const double share = static_cast<double>(std::ranges::count(dropped, true)) / 768;
    CHECK(share > 0.65);
    least = std::min(least, share);
    most = std::max(most, share);
    const auto kept = marked_pixels(through(NoiseLayer::cropout, step));
    CHECK(std::ranges::count(kept, true) >= 0.25 * 768);
    for (std::size_t p = 0; p < 384; ++p) CHECK(kept[p] == kept[384 + p]);  // one window for the batch
    std::size_t top = 16, bottom = 0, left = 24, right = 0;                 // of images of 16 x 24 pixels
    for (std::size_t p = 0; p < 384; ++p)
      if (kept[p]) {
        top = std::min(top, p / 24), bottom = std::max(bottom, p / 24 + 1);
        left = std::min(left, p % 24), right = std::max(right, p % 24 + 1);
      }
    const auto area = static_cast<std::ptrdiff_t>(2 * (bottom - top) * (right - left));
    CHECK(std::ranges::count(kept, true) == area);  // a full rectangle
    smallest_window = std::min(smallest_window, static_cast<double>(area) / 768);
    windows.insert(kept);
  }
  CHECK(smallest_window < 0.6);
  CHECK(windows.size() > 6);
  CHECK(least < 0.85);
  CHECK(most > 0.9);
}

TEST_CASE("image_noise: identity, both JPEGs, and a blur that keeps flat images inside") {
  CHECK(through(NoiseLayer::identity) == kMarked.data);
  CHECK(through(NoiseLayer::simulated_jpeg) ==
        op_values<float>([](auto&, auto v) { return simulated_jpeg(v[0]); }, {kMarked}));
  const auto filed = through(NoiseLayer::real_jpeg);
  Tensor<float> second({16, 24, 3});
  for (Index i = 0; i < second.size(); ++i) second[i] = kMarked[second.size() + i] / 2 + 0.5f;
  const auto expected = jpeg_round_trip(second, 50);
  for (Index i = 0; i < second.size(); ++i)
    CHECK(filed[static_cast<std::size_t>(second.size() + i)] == Approx(2 * expected[i] - 1).margin(1e-6));
  const Tensor<float> flat({1, 16, 16, 3}, 0.5f);
  const auto blurred = op_values<float>(
      [](auto&, auto v) { return apply_noise_layer(NoiseLayer::blur, v[0], v[0], CounterRng(4), 1); },
      {flat});
  for (Index y = 3; y < 13; ++y)
    for (Index x = 3; x < 13; ++x)
      CHECK(blurred[static_cast<std::size_t>((y * 16 + x) * 3)] == Approx(0.5).margin(1e-5));
  CHECK(blurred[0] < 0.5f);
}

TEST_CASE("image_noise: a file passes no gradient on, layers of the two networks, errors") {
  Tape<float> tape;
  Tensor<float> grad(kMarked.shape);
  CHECK(!apply_noise_layer(NoiseLayer::real_jpeg, tape.leaf(kMarked, grad), tape.constant(kPlain),
                           CounterRng(1), 0)
             .needs_grad());
  const auto has = [](auto layers, NoiseLayer l) { return std::ranges::find(layers, l) != layers.end(); };
  CHECK(has(hidden_noise_layers(), NoiseLayer::cropout));
  CHECK(!has(hidden_noise_layers(), NoiseLayer::real_jpeg));
  CHECK(has(mbrs_noise_layers(), NoiseLayer::real_jpeg));
  CHECK(mbrs_noise_layers().size() == 3);
  const Tensor<float> other({1, 16, 24, 3});
  CHECK_THROWS_AS(
      apply_noise_layer(NoiseLayer::identity, tape.constant(kMarked), tape.constant(other), CounterRng(1), 0),
      ShapeError);
}
