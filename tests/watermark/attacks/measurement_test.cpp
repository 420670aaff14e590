#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/watermark/attacks/measurement.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random_weights.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
std::vector<nerf::Camera> cameras(Index count, Index size = 0) {
  return nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, count, size, 8);
}

double mean(const std::vector<double>& v) {
  double sum = 0;
  for (double x : v) sum += x;
  return sum / static_cast<double>(v.size());
}
}  // namespace

TEST_CASE("measurement: figures are the means over the views, view by view") {
  const Owner owner = marking_owner();
  const auto views = cameras(5);
  const Lpips<float> lpips(random_weights(lpips_tensors(LpipsNetwork::squeeze)), LpipsNetwork::squeeze);
  const Measurement m = measure(owner, nullptr, nullptr, {.cameras = views, .seed = 6, .lpips = &lpips});
  nerf::Renderer plain(owner.field), marked(owner.field);
  const CounterRng messages(6, 41);
  std::vector<double> accuracy, whole, object, similarity, perceptual;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Message sent = random_message(4, messages, i);
    marked.set_recolour(owner.marking(cell_signs(owner.code(), sent)));
    const nerf::Rendering base = plain.render(views[i]);
    const Tensor<float> seen = quantize8(marked.render(views[i]).rgb);
    const auto logit = read_bits(BlindReader(owner).evidence(seen), owner.code(), 4).logit;
    double right = 0;
    for (std::size_t b = 0; b < 4; ++b) right += (logit[b] > 0) == (sent.bits[b] == 1);
    accuracy.push_back(right / 4);
    whole.push_back(psnr(seen, base.rgb));
    object.push_back(psnr_masked(seen, base.rgb, base.opacity));
    similarity.push_back(ssim(seen, quantize8(base.rgb)));
    perceptual.push_back(lpips.distance(seen, quantize8(base.rgb)).value);
  }
  CHECK(m.bits == 4);
  CHECK(m.views == 5);
  CHECK_FALSE(m.baked);
  CHECK(m.accuracy.blind == Approx(mean(accuracy)).epsilon(1e-12));
  CHECK(m.accuracy_p5 == *std::min_element(accuracy.begin(), accuracy.end()));
  CHECK(m.psnr_base == Approx(mean(whole)).epsilon(1e-12));
  CHECK(m.psnr_base_foreground == Approx(mean(object)).epsilon(1e-12));
  CHECK(m.psnr_base_foreground < m.psnr_base);
  CHECK(m.ssim_base == Approx(mean(similarity)).epsilon(1e-12));
  CHECK(m.lpips_base == Approx(mean(perceptual)).epsilon(1e-12));
  CHECK(m.lpips_base > 0);
  CHECK(std::isnan(measure(owner, nullptr, nullptr, {.cameras = cameras(1), .seed = 6}).lpips_base));
  CHECK(m.under.empty());
}

TEST_CASE("measurement: distortions are measured each under its name, on the same bits for any threads") {
  const Owner owner = marking_owner();
  const MeasureOptions options{.cameras = cameras(3), .under = {"noise_0", "blur_2", "crop_0.5"}, .seed = 6};
  const ScopedThreads serial(1);
  const Measurement one = measure(owner, nullptr, nullptr, options);
  const ScopedThreads parallel(2);
  const Measurement two = measure(owner, nullptr, nullptr, options);
  REQUIRE(one.under.size() == 3);
  CHECK(one.under.at("noise_0").blind == one.accuracy.blind);
  nerf::Renderer marked(owner.field);
  const std::vector<float> background(3, nerf::background_value(owner.field.background));
  double blind[3] = {};
  for (std::size_t i = 0; i < 3; ++i) {
    const Message sent = random_message(4, CounterRng(6, 41), i);
    marked.set_recolour(owner.marking(cell_signs(owner.code(), sent)));
    const Tensor<float> seen = quantize8(marked.render(options.cameras[i]).rgb);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto distorted = distort::apply_distortion(distort::parse_distortion(options.under[a]), seen,
                                                       CounterRng(6, 42), 3 * i + a, background);
      const auto read = read_bits(BlindReader(owner).evidence(distorted), owner.code(), 4);
      blind[a] += match_bits(read, sent).accuracy() / 3;
    }
  }
  for (std::size_t a = 0; a < 3; ++a) {
    CAPTURE(options.under[a]);
    CHECK(one.under.at(options.under[a]).blind == Approx(blind[a]).epsilon(1e-12));
    CHECK(two.under.at(options.under[a]).blind == one.under.at(options.under[a]).blind);
  }
  CHECK(two.psnr_base == one.psnr_base);
  CHECK(two.ssim_base == one.ssim_base);
  CHECK(two.accuracy_p5 == one.accuracy_p5);
}

TEST_CASE("measurement: a baked field is looked at as it is, with the message it was given") {
  const Owner owner = marking_owner();
  const Message sent{{1, 1, 0, 1}}, opposite{{0, 0, 1, 0}};
  const auto views = cameras(3);
  const Measurement m = measure(owner, &owner.field, &sent, {.cameras = views});
  CHECK(m.baked);
  CHECK(m.ssim_base == Approx(1).epsilon(1e-12));
  CHECK(std::isnan(m.psnr_base));  // undefined for identical images
  const Measurement against = measure(owner, &owner.field, &opposite, {.cameras = views});
  CHECK(m.accuracy.blind + against.accuracy.blind == Approx(1).epsilon(1e-12));
}

TEST_CASE("measurement: progress is told after each view and may stop") {
  const Owner owner = marking_owner();
  std::vector<std::pair<Index, Index>> calls;
  MeasureOptions options{.cameras = cameras(2), .progress = [&](Index done, Index total) {
                           calls.emplace_back(done, total);
                           return calls.size() != 3;
                         }};
  measure(owner, nullptr, nullptr, options);
  CHECK(calls == std::vector<std::pair<Index, Index>>{{1, 2}, {2, 2}});
  CHECK_THROWS_WITH(measure(owner, nullptr, nullptr, options), "stopped while measuring");
  CHECK(calls.size() == 3);
}

TEST_CASE("measurement: messages may be chosen, and each reading is handed out") {
  const Owner owner = marking_owner();
  const Message odd{{1, 0, 1, 1}}, even{{0, 1, 1, 0}};
  const auto of_view = [&](Index view) { return view % 2 ? odd : even; };
  std::vector<std::string> calls;
  double right = 0;
  MeasureOptions options{
      .cameras = cameras(2),
      .under = {"noise_0", "blur_1"},
      .messages = of_view,
      .on_reading = [&](Index view, const std::string& under, const auto& evidence, const Message& sent) {
        calls.push_back(std::to_string(view) + under);
        CHECK(sent == of_view(view));
        if (under.empty()) right += match_bits(read_bits(evidence, owner.code(), 4), sent).accuracy() / 2;
      }};
  const double blind = measure(owner, nullptr, nullptr, options).accuracy.blind;
  CHECK(blind == Approx(right));
  CHECK(calls == std::vector<std::string>{"0", "0noise_0", "0blur_1", "1", "1noise_0", "1blur_1"});
  // Where informed detection is used too, its reading was the one chosen.
  options.informed_views = 2;
  options.under.clear();
  right = 0;
  const double chosen = measure(owner, nullptr, nullptr, options).accuracy.chosen;
  CHECK(chosen == Approx(right));
}

TEST_CASE("measurement: the share of views found counts the p-values of single views up to 1e-6") {
  // More cells than tiny_owner() has: with those, no single view reaches 1e-6.
  Owner owner{tiny_field(),
              {.bits = 4, .mark_psnr = 30, .reader_size = 48},
              test_key(5),
              CellGrid(10, visible_area(tiny_views(), 10), 1e-3),
              cell_mark({.network = {.bands = 4, .features = 8}, .base_channels = 8})};
  owner.gain = 0.1;
  double found = 0;
  MeasureOptions options{
      .cameras = cameras(3, 96),
      .under = {"noise_0.5"},
      .on_reading = [&](Index, const std::string& under, const auto& evidence, const Message& sent) {
        const double p = keyed_p_value(keyed_statistic(evidence, owner.code(), sent));
        if (under.empty() && p <= 1e-6) found += 1;
      }};
  const Measurement blind = measure(owner, nullptr, nullptr, options);
  CHECK(blind.accuracy.found == found / 3);
  options.under.clear();
  found = 0;
  options.informed_views = 2;  // the third view is read blindly and does not count
  options.cameras.resize(2);
  const double both = measure(owner, nullptr, nullptr, options).accuracy.found;
  CHECK(both == found / 2);
  CHECK(both == 1);
  options.cameras = cameras(3, 96);
  options.informed_views = 2;
  CHECK(measure(owner, nullptr, nullptr, options).accuracy.found == both);
  // The unmarked field is not found.
  const Message sent{{1, 1, 0, 1}};
  CHECK(measure(owner, &owner.field, &sent, options).accuracy.found == 0);
}

TEST_CASE("measurement: errors name what is missing") {
  const Owner owner = marking_owner();
  const Message sent{{1, 1, 0, 1}};
  CHECK_THROWS_AS(measure(owner, &owner.field, nullptr, {.cameras = cameras(1)}), ValueError);
  CHECK_THROWS_WITH(measure(owner, nullptr, &sent, {.cameras = cameras(1)}),
                    "[measure] baked and message must be given both or neither");
  CHECK_THROWS_WITH(measure(owner, nullptr, nullptr, {}), "[measure] cameras must not be empty");
  CHECK_THROWS_AS(measure(owner, nullptr, nullptr, {.cameras = cameras(1), .under = {"rain_3"}}), ValueError);
}
