#include <fieldmark/baselines/mark_scores.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/evaluation.h>
#include <fieldmark/watermark/attacks/measurement.h>
#include "owner_system.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "support/catch.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {

watermark::Owner owner_of_6_bits() {
  watermark::OwnerOptions options = small_owner_options();
  options.bits = 6;
  return small_owner(options);
}

std::vector<nerf::Camera> cameras_of(const nerf::RadianceField& field) {
  return nerf::make_cameras(field.cameras, nerf::CameraSet::novel, 4, 0, 5);
}

nerf::Dataset photographs_of(const nerf::RadianceField& field) {
  nerf::Dataset data;
  data.background = field.background;
  nerf::Renderer renderer(field);
  for (const nerf::Camera& camera : cameras_of(field)) {
    const Tensor<float> rgb = renderer.render(camera).rgb;
    Tensor<float> rgba({camera.height, camera.width, 4}, 1);
    for (Index p = 0; p < camera.height * camera.width; ++p)
      for (Index c = 0; c < 3; ++c) rgba[4 * p + c] = 0.9f * rgb[3 * p + c];
    data.views.push_back({camera, rgba, "truth"});
  }
  return data;
}

}  // namespace

// Uses the same views, messages and distortions as watermark::measure(), which has its own loop.
TEST_CASE("mark_scores: an owner's figures are those of measure") {
  const watermark::Owner owner = owner_of_6_bits();
  const auto cameras = cameras_of(owner.field);
  const auto measured =
      watermark::measure(owner, nullptr, nullptr, {.cameras = cameras, .under = {"noise_0.1"}, .seed = 7});
  const TrainedOwner trained{.owner = owner};
  const auto scores = score_mark(owner.field, marked_scene(trained, 7),
                                 {.cameras = cameras, .under = {"noise_0.1"}, .seed = 7});
  CHECK(scores.accuracy == Approx(measured.accuracy.blind).epsilon(1e-12));
  CHECK(scores.under.at("noise_0.1") == Approx(measured.under.at("noise_0.1").blind).epsilon(1e-12));
  CHECK(scores.psnr_base == Approx(measured.psnr_base).epsilon(1e-9));
  CHECK(scores.psnr_base_foreground == Approx(measured.psnr_base_foreground).epsilon(1e-9));
  CHECK(scores.ssim_base == Approx(measured.ssim_base).epsilon(1e-9));
  CHECK(scores.psnr_base < 60);  // there is a mark
  CHECK(std::isnan(scores.psnr_gt));
  CHECK(std::isnan(scores.lpips_base));
}

TEST_CASE(
    "mark_scores: a scene that is not marked, against ground_truth, is what evaluate says of its field") {
  const nerf::RadianceField field = small_field();
  const nerf::Dataset ground_truth = photographs_of(field);
  nerf::Renderer renderer(field), plain(field);
  const auto expected = nerf::evaluate(renderer, ground_truth);
  const MarkedScene marked{.bits = 4,
                           .message = [](Index view) { return message_of_view(4, 0, view); },
                           .render = [&](const nerf::Camera& camera,
                                         const watermark::Message&) { return plain.render(camera).rgb; },
                           .accuracy =
                               [](const Tensor<float>&, const watermark::Message& sent) {
                                 return sent.bits[0] ? 1.0 : 0.5;  // half of messages 0 to 3
                               }};
  const auto scores =
      score_mark(field, marked, {.cameras = cameras_of(field), .ground_truth = &ground_truth});
  CHECK(scores.psnr_gt == Approx(expected.psnr).epsilon(1e-9));
  CHECK(scores.psnr_gt_unmarked == Approx(expected.psnr).epsilon(1e-9));
  CHECK(scores.psnr_gt_object == Approx(expected.psnr_foreground).epsilon(1e-9));
  // evaluate() does not round before ssim(), a difference of 2e-4 here
  CHECK(scores.ssim_gt == Approx(expected.ssim).margin(1e-3));
  CHECK(std::isnan(scores.psnr_base));  // equal images
  CHECK(scores.accuracy == Approx(0.75));
  CHECK(scores.spread == Approx(0.25));
}

TEST_CASE("mark_scores: messages of views") {
  std::set<std::string> seen;
  for (Index view = 0; view < 16; ++view) seen.insert(to_bits(message_of_view(4, 3, view)));
  CHECK(seen.size() == 16);
  CHECK(message_of_view(4, 3, 16) == message_of_view(4, 9, 0));
  CHECK(message_of_view(16, 3, 5) == watermark::random_message(16, CounterRng(3, 41), 5));
}

TEST_CASE("mark_scores: only the first views under distortion, and stopping") {
  const nerf::RadianceField field = small_field();
  nerf::Renderer plain(field);
  int read = 0;
  const MarkedScene marked{
      .bits = 4,
      .message = [](Index view) { return message_of_view(4, 0, view); },
      .render = [&](const nerf::Camera& camera,
                    const watermark::Message&) { return plain.render(camera).rgb; },
      .accuracy = [&](const Tensor<float>&, const watermark::Message&) { return ++read, 1.0; }};
  ScoreOptions options{.cameras = cameras_of(field), .under = {"blur_1", "scale_0.5"}, .under_views = 3};
  CHECK(score_mark(field, marked, options).views == 4);
  CHECK(read == 4 + 3 * 2);
  read = 0;
  options.seconds = 1e-9;  // ends after the views read under distortion
  CHECK(score_mark(field, marked, options).views == 3);
  CHECK(read == 3 + 3 * 2);
  options.seconds = 1e9;
  CHECK(score_mark(field, marked, options).views == 4);
  options.progress = [](double part) { return part < 0.5; };
  CHECK_THROWS_WITH(score_mark(field, marked, options), "stopped while a mark was measured");
  CHECK_THROWS_WITH(score_mark(field, marked, {}), "[score_mark] cameras must not be empty");
  options.under = {"melt_1"};
  CHECK_THROWS_AS(score_mark(field, marked, options), ValueError);
}
