#include <fieldmark/core/error.h>
#include <fieldmark/tools/bench/field_bench.h>
#include "field_reference.h"

#include <algorithm>
#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
std::vector<nerf::Camera> test_cameras() {
  std::vector<nerf::Camera> cameras;
  for (const double x : {2.2, -1.5})
    cameras.push_back(
        nerf::make_camera(nerf::look_at({x, -3.1, 1.7}, {0.1, 0.2, 0}, {0, 0, 1}), 0.6, 20, 16));
  return cameras;
}

FieldRow field_row(const std::string& name, double seconds, double psnr, bool front) {
  return {.variant = {name, "x"}, .seconds = seconds, .psnr = psnr, .front = front};
}
}  // namespace

TEST_CASE("field_bench: figures of the default are those of its images and the reference's") {
  nerf::RadianceField f = small_field();
  f.params.values(f.params.find("density/1/bias"))[0] += 2;
  const auto cameras = test_cameras();
  std::vector<std::string> said;
  const FieldBench bench =
      run_field_bench(f, cameras, {.runs = 1, .samples = 256, .unmasked_pixels = 50, .quick = true},
                      [&](const std::string& what, double part) {
                        said.push_back(what);
                        CHECK((part >= 0 && part <= 1));
                      });
  CHECK(said.size() >= bench.rows.size() + 3);
  REQUIRE(bench.rows.size() == field_variants(f, true).size());
  FieldReference reference(f, {.samples = 256});
  nerf::Renderer renderer(f);
  double squares = 0, worst = 0, dropped = 0, most = 0, n = 0;
  for (const auto& camera : cameras) {
    const auto want = reference.render(camera);
    const auto view = renderer.render(camera);
    for (Index p = 0; p < view.opacity.size(); ++p, ++n) {
      const double* w = &want[static_cast<std::size_t>(4 * p)];
      for (Index a = 0; a < 3; ++a) {
        const double off = std::abs(static_cast<double>(view.rgb[3 * p + a]) - w[a]);
        squares += off * off;
        raise_to(worst, off);
      }
      double missing = 0;
      raise_to(missing, w[3] - static_cast<double>(view.opacity[p]));
      dropped += missing;
      raise_to(most, missing);
    }
  }
  const FieldRow& first = bench.rows.front();
  CHECK(first.variant.knob == "default");
  CHECK(first.psnr == Approx(-10 * std::log10(squares / (3 * n))));
  CHECK(first.max_error == Approx(worst));
  CHECK(first.dropped_mean == Approx(dropped / n));
  CHECK(first.dropped_max == Approx(most));
  CHECK(first.dropped_max > 0);
  for (const FieldRow& r : bench.rows) CHECK(r.seconds > 0);
  const double cells = static_cast<double>(f.grid.cells());
  CHECK(first.grid_bytes == cells / 8);
  CHECK(std::any_of(bench.rows.begin(), bench.rows.end(), [](const auto& r) { return r.front; }));
  // Every cell is occupied: the grid skips nothing.
  CHECK(bench.occupancy.pixels == 100);
  CHECK(std::isinf(bench.occupancy.psnr));
  CHECK(bench.occupancy.dropped_max == 0);
}

TEST_CASE("field_bench: what the grid leaves out is counted") {
  nerf::RadianceField f = small_field();
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(f.grid.cells()));
  for (std::size_t c = 0; c < bits.size(); ++c) bits[c] = c < bits.size() / 2;
  f.grid.set_bits(bits);
  const FieldBench bench =
      run_field_bench(f, test_cameras(), {.runs = 1, .samples = 64, .unmasked_pixels = 1000, .quick = true});
  CHECK(bench.occupancy.pixels == 640);  // a view has no more pixels
  CHECK(bench.occupancy.psnr < 60);
  CHECK(bench.occupancy.dropped_max > 0.01);
  CHECK(bench.occupancy.dropped_mean > 0);
  CHECK(bench.occupancy.dropped_mean < bench.occupancy.dropped_max);
}

TEST_CASE("field_bench: the judgement names what is faster and what is better") {
  FieldBench bench;
  bench.rows = {field_row("default", 1, 40, true), field_row("a", 0.5, 30, true),
                field_row("b", 0.8, 35, true),     field_row("c", 2, 50, true),
                field_row("d", 3, 60, true),       field_row("e", 0.99, 20, false)};
  const std::string text = judgement(bench);
  CHECK_THAT(text, Contains("It is on the front") &&
                       Contains("b x, takes 0.80 of its time and is 5.0 dB below") &&
                       Contains("c x, takes 2.00 times as long for 10.0 dB more"));
  bench.rows = {field_row("default", 1, 40, false), field_row("a", 0.5, 41, true)};
  CHECK_THAT(judgement(bench), Contains("It is not on the front") && Contains("1.0 dB above it"));
  bench.rows = {field_row("default", 1, 40, true), field_row("a", 0.5, 40, true)};
  bench.rows[0].grid_bytes = 100;
  bench.rows[1].grid_bytes = 800;
  CHECK_THAT(judgement(bench),
             Contains("takes 0.50 of its time and is 0.0 dB above it, with 8 times the grid;"));
  bench.rows = {field_row("default", 1, 40, true)};
  CHECK_THAT(judgement(bench), Contains("nothing is more than 4% faster; nothing is more exact."));
  CHECK_THROWS_AS(judgement(FieldBench{}), ValueError);
}

TEST_CASE("field_bench: errors") {
  const nerf::RadianceField f = small_field();
  CHECK_THROWS_WITH(run_field_bench(f, {}), "[field_bench] cameras must not be empty");
  CHECK_THROWS_WITH(run_field_bench(f, test_cameras(), {.runs = 0}),
                    "[field_bench] runs and unmasked_pixels must be at least 1, got 0 and 4096");
}
