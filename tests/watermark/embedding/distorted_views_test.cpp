#include "distorted_views.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

// Returns the inner pixels of what a draw shows of 48 x 48 grey pixels. A shift of a pixel reaches the
// others.
std::vector<float> shown(const TrainingImage& image, Tape<float>& tape) {
  float* grey = tape.scratch(48 * 48 * 3);
  std::fill_n(grey, 48 * 48 * 3, 0.5f);
  const Var<float> out = image.distort(tape.constant(grey, {48, 48, 3}));
  std::vector<float> inner;
  for (Index y = 8; y < 40; ++y)
    inner.insert(inner.end(), out.value() + 3 * (48 * y + 8), out.value() + 3 * (48 * y + 40));
  return inner;
}

}  // namespace

TEST_CASE("distorted_views: step and image determine the draw, and images differ") {
  const Owner owner = tiny_owner();
  const DistortedViews drawn(owner, tiny_views(), {}, 3, 7), again(owner, tiny_views(), {}, 3, 7),
      other(owner, tiny_views(), {}, 3, 8);
  const auto all = [](const DistortedViews& d) {
    std::vector<std::vector<float>> images;
    for (Index step = 0; step < 3; ++step)
      for (Index image = 0; image < 3; ++image) {
        Tape<float> tape;
        images.push_back(shown(d.draw(step, image, tape), tape));
      }
    return images;
  };
  const auto first = all(drawn);
  CHECK(all(again) == first);
  CHECK(all(other) != first);
  // Few images are neither warped nor blurred nor noisy.
  CHECK(std::set(first.begin(), first.end()).size() >= 7);
  CHECK(drawn.place(2, 1) == 7);
  Tape<float> tape;
  const TrainingImage chosen = drawn.draw_of(5, 2, 1, tape);
  CHECK(chosen.view == 5);
  CHECK(shown(chosen, tape) == first[7]);  // the same distortions of grey
}

TEST_CASE("distorted_views: every view is drawn, positions move by the shift, code and message stay empty") {
  const Owner owner = tiny_owner();
  const DistortedViews drawn(owner, tiny_views(), {.sample_shift = 0.01}, 1, 7);
  std::vector<int> times(tiny_views().size());
  double squares = 0, n = 0;
  for (Index step = 0; step < 80; ++step) {
    Tape<float> tape;
    const TrainingImage image = drawn.draw(step, 0, tape);
    ++times[static_cast<std::size_t>(image.view)];
    CHECK(image.step == step);
    CHECK(image.message.size() == 0);
    CHECK(image.signs.empty());
    const CachedView& view = tiny_views()[static_cast<std::size_t>(image.view)];
    for (std::size_t i = 0; i < view.position.size(); ++i, ++n)
      squares += std::pow(static_cast<double>(image.positions[i] - view.position[i]), 2);
  }
  CHECK(std::ranges::min(times) > 0);
  CHECK(std::sqrt(squares / n) == Approx(0.01).epsilon(0.02));
}

// Grey stays grey under rotation, zoom and blur inside the image; noise has the standard deviation drawn.
TEST_CASE(
    "distorted_views: without distortions an image is only rounded to 8 bits, kinds come alone if not "
    "mixed") {
  const Owner owner = tiny_owner();
  const EmbedDistortions none{.noise = 0, .rotation = 0, .zoom_out = 1, .zoom_in = 1, .blur = 0};
  const DistortedViews plain(owner, tiny_views(), none, 1, 7);
  EmbedDistortions only_noise = none;
  only_noise.noise = 0.1;
  only_noise.mixed = false;
  const DistortedViews noisy(owner, tiny_views(), only_noise, 1, 7);
  int with_noise = 0;
  for (Index step = 0; step < 100; ++step) {
    Tape<float> tape;
    const auto image = shown(plain.draw(step, 0, tape), tape);
    CHECK(std::ranges::all_of(image, [](float v) { return v == 128.f / 255 || v == 127.f / 255; }));
    const TrainingImage drawn = noisy.draw(step, 0, tape);
    const auto values = shown(drawn, tape);
    const bool is_noisy = std::ranges::any_of(values, [](float v) { return std::abs(v - 0.5f) > 0.01f; });
    with_noise += is_noisy;
    if (is_noisy) CHECK(!drawn.warped);
  }
  CHECK(with_noise > 8);  // a fifth of the steps: 20 +- 4
  CHECK(with_noise < 33);
}
