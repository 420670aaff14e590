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

// Returns the loss of one undistorted view while a share of the signs is read.
double loss(const CellTrainingOptions& options, double right) {
  const Owner owner = tiny_owner(kDb, options);
  const auto training = owner.mark().training(owner, tiny_views());
  Tape<float> tape;
  const TrainingImage image{.view = kView,
                            .code = owner.code(),
                            .message = sent(),
                            .signs = cell_signs(owner.code(), sent()),
                            .positions = tiny_views()[kView].position.data(),
                            .distort = [](Var<float> x) { return x; }};
  TrainingFigures figures;
  return static_cast<double>(
      training->loss(tape, Params<float>(owner.params, nullptr), {&image, 1}, {.sign = right}, figures)
          .value()[0]);
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

TEST_CASE("cell_training: the loss adds the power that pixels have beyond the peak") {
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

TEST_CASE("cell_training: hiding phases in while the signs become readable") {
  const CellTrainingOptions specks = only_specks(0, 1);
  const double without = loss(only_specks(0, 0), 0);
  CHECK(loss(specks, 0.7) == Approx(without).epsilon(1e-6));
  CHECK(loss(specks, 0.75) - without == Approx(0.5).epsilon(1e-3));
  CHECK(loss(specks, 0.8) - without == Approx(1).epsilon(1e-3));
  CHECK(loss({.first_mark_psnr = kDb, .peak_weight = 0}, 0.7) == Approx(without).epsilon(1e-6));
  CHECK(loss({.first_mark_psnr = kDb, .peak_weight = 0}, 0.8) > without + 0.01);
}
