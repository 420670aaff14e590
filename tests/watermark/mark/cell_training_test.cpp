#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

constexpr Index kView = 2;
constexpr double kDb = 30;

CellTrainingOptions only_specks(double peak, double weight) {
  return {.first_mark_psnr = kDb, .smooth_weight = 0, .flat_weight = 0, .peak = peak, .peak_weight = weight};
}

// Returns the message that the marked view carries.
Message sent() { return {{1, 0, 0, 1}}; }

// Returns the loss of one undistorted view while a share of the signs is read, and adds its gradient.
double loss(const Owner& owner, double right, float* grads = nullptr,
            std::span<const CachedView> views = tiny_views()) {
  const auto training = owner.mark().training(owner, views);
  Tape<float> tape;
  const TrainingImage image{.view = kView,
                            .code = owner.code(),
                            .message = sent(),
                            .signs = cell_signs(owner.code(), sent()),
                            .positions = views[kView].position.data(),
                            .distort = [](Var<float> x) { return x; }};
  TrainingFigures figures;
  const auto out =
      training->loss(tape, Params<float>(owner.params, grads), {&image, 1}, {.sign = right}, figures);
  if (grads) tape.backward(out);
  return static_cast<double>(out.value()[0]);
}
double loss(const CellTrainingOptions& options, double right) {
  return loss(tiny_owner(kDb, options), right);
}

// Returns the change of each colour of the foreground in units of its RMS, summed here from the samples.
std::vector<double> change() {
  const Owner owner = tiny_owner(kDb);
  const CachedView& v = tiny_views()[kView];
  const Index n = static_cast<Index>(v.weight.size());
  std::vector<float> s(v.weight.size());
  owner.cells.blend(cell_signs(owner.code(), sent()), v.position.data(), n, s.data());
  Tape<float> tape;
  const auto carrier =
      owner.mark().carrier(Params<float>(owner.params, nullptr), tape.constant(v.position.data(), {n, 3}),
                           tape.constant(v.colour.data(), {n, 3}));
  const auto foreground = foreground_mask(v);
  std::vector<double> all;
  double square = 0;
  for (std::size_t p = 0; p < foreground.size(); ++p)
    for (Index c = 0; c < 3 && foreground[p] > 0; ++c) {
      double r = 0;
      for (auto k = static_cast<std::size_t>(v.sample_begin[p]);
           k < static_cast<std::size_t>(v.sample_begin[p + 1]); ++k)
        r += static_cast<double>(v.weight[k] * s[k] * carrier.value()[3 * static_cast<Index>(k) + c]);
      all.push_back(r);
      square += r * r;
    }
  const double rms = std::sqrt(square / static_cast<double>(all.size()));
  for (double& r : all) r /= rms;
  return all;
}

}  // namespace

TEST_CASE("cell_training: the loss adds the power that colours have beyond the peak") {
  const auto changes = change();
  const double without = loss(only_specks(1, 0), 1);
  for (const double peak : {0.0, 0.5, 1.5, 2.0}) {
    double want = 0;
    for (const double r : changes) {
      const double over = std::max(std::abs(r) - peak, 0.0);
      want += over * over / static_cast<double>(changes.size());
    }
    CAPTURE(peak, want);
    CHECK(want > 1e-3);
    CHECK(loss(only_specks(peak, 1), 1) - without == Approx(want).epsilon(1e-3));
    CHECK(loss(only_specks(peak, 3), 1) - without == Approx(3 * want).epsilon(1e-3));
  }
  CHECK(loss(only_specks(1000, 1), 1) == Approx(without).epsilon(1e-6));
}

// The weight of the output layer's three biases moves all colours up or down, so that specks of both signs
// count.
TEST_CASE("cell_training: the gradient of specks is that of central differences") {
  Owner owner = tiny_owner(kDb, only_specks(1, 1000));
  std::vector<float> grads(owner.params.values().size());
  loss(owner, 1, grads.data());
  const auto& entries = owner.params.entries();
  const auto bias = std::ranges::find_if(entries, [](const auto& e) { return e.name == "mark/fuse/1/bias"; });
  REQUIRE(bias != entries.end());
  for (Index i = bias->offset; i < bias->offset + 3; ++i) {
    constexpr float kStep = 2e-3f;
    float& weight = owner.params.values()[static_cast<std::size_t>(i)];
    const float before = weight;
    weight = before + kStep;
    const double up = loss(owner, 1);
    weight = before - kStep;
    const double down = loss(owner, 1);
    weight = before;
    CAPTURE(i - bias->offset);
    CHECK(static_cast<double>(grads[static_cast<std::size_t>(i)]) ==
          Approx((up - down) / (2 * static_cast<double>(kStep))).epsilon(0.01).margin(0.5));
  }
}

TEST_CASE("cell_training: a view of the background alone has no specks") {
  auto views = tiny_views();
  std::ranges::fill(views[kView].opacity.data, 0.f);
  const double without = loss(tiny_owner(kDb, only_specks(0, 0)), 1, nullptr, views);
  CHECK(std::isfinite(without));
  CHECK(loss(tiny_owner(kDb, only_specks(0, 1)), 1, nullptr, views) == without);
}

TEST_CASE("cell_training: hiding phases in while the signs become readable") {
  const CellTrainingOptions specks = only_specks(0, 1);
  const double without = loss(only_specks(0, 0), 0);
  CHECK(loss(specks, 0.2) == Approx(without).epsilon(1e-6));
  CHECK(loss(specks, 0.7) == Approx(without).epsilon(1e-6));
  CHECK(loss(specks, 0.75) - without == Approx(0.5).epsilon(1e-3));
  CHECK(loss(specks, 0.8) - without == Approx(1).epsilon(1e-3));
  CHECK(loss(specks, 1) - without == Approx(1).epsilon(1e-3));
  CHECK(loss({.first_mark_psnr = kDb, .peak_weight = 0}, 0.7) == Approx(without).epsilon(1e-6));
  CHECK(loss({.first_mark_psnr = kDb, .peak_weight = 0}, 0.8) > without + 0.01);
}
