#include "reading_guide.h"

#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

const Message kGuided{{1, 0, 1, 1}};

ReadingGuide guide(const Owner& owner, double strength) { return {owner, kGuided, 4, strength, 11}; }

// Returns the shifts of the view of a turn.
std::vector<float> shifts_of(ReadingGuide& guided, Index turn) {
  const CachedView& view = guided.view(turn);
  const auto size = static_cast<std::ptrdiff_t>(3 * view.height * view.width);
  const auto from = guided.shifts().begin() + turn % 4 * size;
  return {from, from + size};
}

// A change of all foreground pixels by about 0.02, the same for the same view.
std::vector<float> some_change(const CachedView& view) {
  const CounterRng rng(3, 1);
  const auto foreground = foreground_mask(view);
  std::vector<float> change(3 * foreground.size());
  for (std::size_t i = 0; i < change.size(); ++i)
    change[i] = foreground[i / 3] * 0.02f * rng.normal4(0, i)[0];
  return change;
}

double rms(std::span<const float> x, const std::vector<float>& foreground) {
  double squares = 0, n = 0;
  for (std::size_t i = 0; i < x.size(); ++i)
    if (foreground[i / 3] > 0) {
      squares += static_cast<double>(x[i]) * static_cast<double>(x[i]);
      n += 1;
    }
  return std::sqrt(squares / n);
}

}  // namespace

TEST_CASE(
    "reading_guide: shifts are bounded by the mark's size, lie on the object, and scale with the "
    "strength") {
  const Owner owner = tiny_owner();
  ReadingGuide one = guide(owner, 1), two = guide(owner, 2);
  for (Index turn = 0; turn < 6; ++turn) {
    const CachedView& view = one.view(turn);
    const auto change = some_change(view);
    const auto foreground = foreground_mask(view);
    one.read(turn, change, change);
    two.read(turn, change, change);
    const auto shift = shifts_of(one, turn), twice = shifts_of(two, turn);
    const double of_change = rms(change, foreground), of_shift = rms(shift, foreground);
    CHECK(of_shift > 0.5 * of_change);  // less than the change's where gradients were cut to 3 RMS
    CHECK(of_shift <= 1.0001 * of_change);
    for (std::size_t i = 0; i < shift.size(); ++i) {
      CHECK(std::abs(static_cast<double>(shift[i])) <= 3.0001 * of_change);
      if (foreground[i / 3] == 0) CHECK(shift[i] == 0);
      CHECK(twice[i] == Approx(2 * shift[i]).epsilon(1e-5));
    }
  }
}

// The loss along the shifts, by the mark's own training on the same views and draws.
TEST_CASE("reading_guide: a small step along the shifts lowers the reading loss") {
  const Owner owner = tiny_owner();
  const std::uint64_t seed = 11;
  ReadingGuide guided = guide(owner, 1);
  const auto views = cache_embed_views(owner.field, owner.options().patch(), {.count = 4}, seed);
  const DistortedViews drawn(owner, views, {}, 1, seed);
  const auto training = owner.mark().training(owner, views);
  for (Index turn = 0; turn < 6; ++turn) {
    const auto change = some_change(guided.view(turn));
    guided.read(turn, change, change);
    const auto shift = shifts_of(guided, turn);
    const auto loss = [&](float along) {
      Tape<float> tape;
      TrainingImage image = drawn.draw_of(turn % 4, turn, 0, tape);
      image.code = owner.code();
      image.message = kGuided;
      image.signs = cell_signs(image.code, kGuided);
      const CachedView& view = views[static_cast<std::size_t>(image.view)];
      std::vector<float> marked(change.size());
      for (std::size_t i = 0; i < marked.size(); ++i)
        marked[i] = std::clamp(view.base.data[i] + change[i] + along * shift[i], 0.f, 1.f);
      TrainingFigures figures;
      return static_cast<double>(
          training
              ->reading_loss(Params<float>(owner.params, nullptr),
                             tape.constant(marked.data(), {view.height * view.width, 3}), image, figures)
              .value()[0]);
    };
    CAPTURE(turn);
    CHECK(loss(0.5f) < loss(0));
    CHECK(loss(-0.5f) > loss(0));
  }
}

TEST_CASE("reading_guide: no mark gives no shifts, one and two threads give the same ones") {
  const Owner owner = tiny_owner();
  ReadingGuide guided = guide(owner, 1);
  const CachedView& view = guided.view(0);
  const auto change = some_change(view);
  guided.read(0, change, std::vector<float>(change.size()));
  CHECK(std::ranges::all_of(shifts_of(guided, 0), [](float s) { return s == 0; }));
  const ScopedThreads serial(1);
  guided.read(0, change, change);
  const auto one = shifts_of(guided, 0);
  const ScopedThreads parallel(2);
  guided.read(0, change, change);
  CHECK(shifts_of(guided, 0) == one);
}

TEST_CASE("reading_guide: pixels come from the views read so far, each with its own shift") {
  const Owner owner = tiny_owner();
  ReadingGuide guided = guide(owner, 1);
  for (Index turn = 0; turn < 2; ++turn)
    guided.read(turn, some_change(guided.view(turn)), some_change(guided.view(turn)));
  const CounterRng rng(5, 1);
  int of_view[2] = {}, shifted = 0;
  for (std::uint64_t i = 0; i < 400; ++i) {
    const auto u = rng.uniform4(0, i);
    const ReadingGuide::Pixel pixel = guided.pick(std::span(u).first<3>(), 2);
    const Index turn = &pixel.camera == &guided.view(0).camera ? 0 : 1;
    const CachedView& view = guided.view(turn);
    REQUIRE(&pixel.camera == &view.camera);
    ++of_view[turn];
    const auto x = static_cast<Index>(pixel.place[0]), y = static_cast<Index>(pixel.place[1]);
    REQUIRE(x < view.width);
    REQUIRE(y < view.height);
    const auto shift = shifts_of(guided, turn);
    REQUIRE(std::ranges::equal(
        pixel.shift, std::span(shift).subspan(static_cast<std::size_t>(3 * (y * view.width + x)), 3)));
    shifted += pixel.shift[0] != 0;
  }
  CHECK(of_view[0] > 150);
  CHECK(of_view[1] > 150);
  CHECK(shifted > 40);
  const std::array<float, 3> last{0.999f, 0.999f, 0.999f};
  CHECK(&guided.pick(last, 1).camera == &guided.view(0).camera);
  CHECK(&guided.pick(last, 9).camera == &guided.view(3).camera);
}
