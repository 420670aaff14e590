#include <fieldmark/core/error.h>
#include <fieldmark/engine/ops/resample.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/vgg16_features.h>

#include <string_view>

#include "support/data.h"
#include "support/expect_grad.h"
#include "support/plain_conv.h"
#include "support/random_weights.h"
#include "support/run_op.h"
#include "support/worst.h"

using namespace fieldmark;

namespace {

constexpr int kConvs[] = {0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28};
constexpr int kPoolBefore[] = {5, 10, 17, 24};

SafetensorsFile weights(std::size_t convolutions) {
  const auto all = vgg16_tensors();
  return random_weights(std::span(all).first(2 * convolutions));
}

std::vector<PlainImage> plain_features(const Tensor<float>& image, const SafetensorsFile& file,
                                       std::size_t convolutions) {
  constexpr double mean[] = {0.485, 0.456, 0.406}, deviation[] = {0.229, 0.224, 0.225};
  PlainImage x = plain_image(3, image.shape[0], image.shape[1]);
  for (long c = 0; c < 3; ++c)
    for (long i = 0; i < x.h * x.w; ++i)
      x.x[static_cast<std::size_t>(c * x.h * x.w + i)] =
          (static_cast<double>(image[i * 3 + c]) - mean[c]) / deviation[c];
  std::vector<PlainImage> all;
  for (std::size_t k = 0; k < convolutions; ++k) {
    for (const int before : kPoolBefore)
      if (kConvs[k] == before) x = plain_max_pool(x, 2, 2, false);
    x = plain_conv(x, file, "features." + std::to_string(kConvs[k]), 1, 1);
    all.push_back(x);
  }
  return all;
}

double plain_mean_square(const PlainImage& a, const PlainImage& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.x.size(); ++i) sum += (a.x[i] - b.x[i]) * (a.x[i] - b.x[i]);
  return sum / static_cast<double>(a.x.size());
}

std::vector<std::string_view> views_of(const std::vector<std::string>& names) {
  return {names.begin(), names.end()};
}

// Compares every depth with plain loops, and the loss of two of them; returns the worst error of a depth.
double compare(const SafetensorsFile& file, std::size_t convolutions, const Tensor<float>& a,
               const Tensor<float>& b) {
  const Vgg16Features<float> vgg(file);
  const auto names = vgg.depths();
  REQUIRE(names.size() == convolutions);
  const auto want = plain_features(a, file, convolutions), other = plain_features(b, file, convolutions);
  Tape<float> tape;
  const Shape shape{1, a.shape[0], a.shape[1], 3};
  const auto va = tape.constant(a.data.data(), shape), vb = tape.constant(b.data.data(), shape);
  const auto taps = views_of(names);
  const auto found = vgg(va, taps);
  double worst = 0;
  for (std::size_t k = 0; k < convolutions; ++k) {
    REQUIRE(found[k].shape() == Shape({1, want[k].h, want[k].w, want[k].c}));
    raise_to(worst, plain_error(want[k], found[k].value()));
  }
  constexpr std::string_view two[] = {"relu2_2", "relu1_2"};
  const double loss = plain_mean_square(want[1], other[1]) + plain_mean_square(want[3], other[3]);
  CHECK(static_cast<double>(vgg.loss(va, vb, two).value()[0]) == Approx(loss).epsilon(1e-5));
  return worst;
}

}  // namespace

TEST_CASE("vgg16_features: all depths and the loss equal plain loops, with random weights") {
  auto file = weights(13);
  file.add("classifier.0.weight", {2, 3}, std::span<const float>(Tensor<float>({6}).data));
  const auto a = uniform<float>({17, 20, 3}, 0, 1, 3), b = uniform<float>({17, 20, 3}, 0, 1, 4);
  CHECK(compare(file, 13, a, b) < 1e-5);
  const Vgg16Features<float> vgg(file);
  CHECK(vgg.depths().front() == "relu1_1");
  CHECK(vgg.depths().back() == "relu5_3");
}

TEST_CASE("vgg16_features: the first layers with torchvision's weights equal plain loops") {
  const auto path = data_or_skip("weights/vgg16_conv1_1-conv2_2.safetensors", "VGG-16's first layers");
  const auto folder = data_or_skip("lpips_reference", "VGG-16's first layers");
  if (!path || !folder) return;
  const auto whole_a = read_image(*folder / "official_ex_ref_p0_a.png"),
             whole_b = read_image(*folder / "official_ex_ref_p0_b.png");
  const auto corner = [](const Tensor<float>& whole) {
    Tensor<float> part({20, 23, 3});
    for (Index i = 0; i < part.size(); ++i) part[i] = whole[(i / 69) * whole.shape[1] * 3 + i % 69];
    return part;
  };
  CHECK(compare(SafetensorsFile::read(*path), 4, corner(whole_a), corner(whole_b)) < 1e-5);
}

TEST_CASE("vgg16_features: gradient of the loss in both images") {
  const Vgg16Features<double> vgg(weights(3));
  constexpr std::string_view taps[] = {"relu1_2", "relu2_1"};
  // Small steps, because kinks of ReLUs and pooling windows lie close together.
  expect_grad(
      [&](Tape<double>&, auto v) { return vgg.loss(upsample_to(v[0], 4, 5), upsample_to(v[1], 4, 5), taps); },
      {uniform({1, 2, 1, 3}, 0, 1, 5), uniform({1, 2, 1, 3}, 0, 1, 6)}, {.step = 1e-5});
}

TEST_CASE("vgg16_features: errors") {
  CHECK_THROWS_WITH(
      Vgg16Features<float>(SafetensorsFile()),
      Contains("tensor \"features.0.weight\": expected F32 [64, 3, 3, 3], found none of this name"));
  const auto tensors = vgg16_tensors();
  CHECK_THROWS_WITH(Vgg16Features<float>(random_weights(tensors, "features.5.bias")),
                    Contains("tensor \"features.5.bias\": expected F32 [128], found none of this name"));
  const Vgg16Features<float> vgg(weights(4));
  Tape<float> tape;
  const Tensor<float> x({1, 4, 1, 3}), other({1, 4, 4, 3}), grey({1, 4, 4, 1});
  constexpr std::string_view deep[] = {"relu3_1"}, unknown[] = {"relu2_3"}, second[] = {"relu2_1"};
  CHECK_THROWS_WITH(
      vgg(tape.constant(other), deep),
      "[vgg16_features] taps: expected depths from relu1_1 to relu2_2 (what the weights reach), "
      "got relu3_1");
  CHECK_THROWS_WITH(vgg(tape.constant(other), unknown), Contains("got relu2_3"));
  CHECK_THROWS_WITH(
      vgg(tape.constant(x), second),
      "[vgg16_features] x: height and width must be at least 2 (down to relu2_1), got shape [1, 4, "
      "1, 3]");
  CHECK_THROWS_WITH(vgg(tape.constant(grey), second), Contains("[vgg16_features] x: axis 3 must be 3 (RGB)"));
  CHECK_THROWS_WITH(vgg.loss(tape.constant(other), tape.constant(x), second),
                    Contains("must have the shape of a"));
  CHECK_THROWS_WITH(vgg.loss(tape.constant(other), tape.constant(other), {}),
                    "[vgg16_features] taps must not be empty");
}

TEST_CASE("vgg16_features: the same bits for any thread count") {
  const Vgg16Features<float> vgg(weights(4));
  constexpr std::string_view taps[] = {"relu2_2"};
  expect_same_bits([&](auto&, auto v) { return vgg.loss(v[0], v[1], taps); },
                   {uniform<float>({1, 40, 50, 3}, 0, 1, 3), uniform<float>({1, 40, 50, 3}, 0, 1, 4)});
}
