#include <fieldmark/core/error.h>
#include <fieldmark/distort/blur.h>
#include <fieldmark/distort/distortion.h>
#include <fieldmark/distort/quantize8.h>
#include <fieldmark/distort/resize_area.h>
#include <fieldmark/distort/rotate.h>
#include <fieldmark/imaging/image_format.h>
#include <fieldmark/imaging/resize.h>

#include <cmath>
#include <numbers>
#include <set>

#include "distort/support.h"
#include "support/catch.h"
#include "support/library.h"
#include "support/worst.h"

using namespace fieldmark;
using distort::apply_distortion;
using distort::DistortionKind;
using distort::parse_distortion;

namespace {
const std::vector<float> kWhite{1, 1, 1};
const CounterRng kRng(7);

Tensor<float> distorted(const char* name, const Tensor<float>& x, std::uint64_t index = 0) {
  return apply_distortion(parse_distortion(name), x, kRng, index, kWhite);
}

Tensor<float> rounded(const Tensor<float>& x) {
  return op_result<float>([](auto&, auto v) { return distort::quantize8(v[0]); }, {x});
}

Tensor<float> image(Shape shape, unsigned seed = 1) { return rounded(uniform<float>(shape, 0, 1, seed)); }

// Encodes the column in red and the row in green, in levels of 1/255.
Tensor<float> coordinates(Index h, Index w) {
  Tensor<float> x({h, w, 3});
  for (Index i = 0; i < h * w; ++i) {
    x[i * 3] = static_cast<float>(i % w) / 255;
    x[i * 3 + 1] = static_cast<float>(i / w) / 255;
  }
  return x;
}
}  // namespace

TEST_CASE("distortion: names, chains and combined") {
  const auto a = parse_distortion("noise_0.05");
  CHECK(a.name == "noise_0.05");
  CHECK(a.steps.size() == 1);
  CHECK((a.steps[0].kind == DistortionKind::noise && a.steps[0].amount == 0.05));
  const auto chain = parse_distortion("rotation_30,jpeg_50,hue_-20");
  CHECK(chain.steps.size() == 3);
  CHECK((chain.steps[2].kind == DistortionKind::hue && chain.steps[2].amount == -20));
  const auto x = image({24, 20, 3});
  CHECK(distorted("combined", x).data == distorted("noise_0.10,crop_0.40,jpeg_50", x).data);
  CHECK(distorted("blur_1,combined", x).data == distorted("blur_1,noise_0.1,crop_0.4,jpeg_50", x).data);
  CHECK(parse_distortion("combined").name == "combined");
}

TEST_CASE("distortion: errors") {
  const Tensor<float> grey({2, 2, 1}), none({0, 2, 3}), x({2, 2, 3});
  CHECK_THROWS_WITH(distorted("blur_1", grey),
                    "[distortion] image: axis 2 must be 3 (red, green and blue), got shape [2, 2, 1]");
  CHECK_THROWS_WITH(distorted("blur_1", none),
                    "[distortion] image: must have at least one pixel, got shape [0, 2, 3]");
  CHECK_THROWS_AS(distorted("blur_1", Tensor<float>({4})), ShapeError);
  CHECK_THROWS_WITH(apply_distortion(parse_distortion("blur_1"), x, kRng, 0, {}),
                    "[distortion] background: must have 3 elements, got 0");
}

TEST_CASE("distortion: severities of nothing leave an 8-bit image as it is") {
  for (Shape s : {Shape{9, 6, 3}, Shape{1, 1, 3}}) {
    const auto x = image(s);
    for (const char* name : {"noise_0", "rotation_0", "scale_1", "blur_0", "blur_1e-6", "crop_1", "gamma_1",
                             "scale-nearest_1", "scale-bilinear_1", "scale-bicubic_1", "scale-lanczos_1",
                             "brightness_1", "contrast_1", "hue_0", "hue_360", "noise_0,crop_1,scale_1"}) {
      INFO(name);
      CHECK(distorted(name, x).data == x.data);
    }
  }
}

TEST_CASE("distortion: every result is of 8 bits and depends on the seed and the index alone") {
  const auto x = image({30, 40, 3}), large = image({150, 200, 3});
  for (const char* name : {"noise_0.05",
                           "rotation_30",
                           "scale_0.75",
                           "blur_1",
                           "crop_0.40",
                           "jpeg_50",
                           "gamma_2.2",
                           "brightness_1.5",
                           "hue_90",
                           "combined",
                           "scale-nearest_0.75",
                           "scale-bilinear_1.3",
                           "scale-bicubic_0.75",
                           "scale-lanczos_0.5",
                           "jpeg444_50",
                           "contrast_1.5",
                           "greyscale",
                           "screenshot",
                           "sepia",
                           "mirror",
                           "caption",
                           "collage",
                           "part_0.6",
                           "background_noise"}) {
    INFO(name);
    const auto y = distorted(name, x, 3);
    CHECK(y.data == rounded(y).data);
    const auto z = distorted(name, large, 3);
    const ScopedThreads scope(threads() == 1 ? 2 : 1);
    CHECK(z.data == distorted(name, large, 3).data);
    CHECK(distorted(name, image({1, 1, 3})).shape == Shape{1, 1, 3});
  }
  for (const char* name : {"noise_0.05", "rotation_30", "crop_0.40"})
    CHECK(distorted(name, x, 3).data != distorted(name, x, 4).data);
  CHECK(distorted("noise_0.05,noise_0.05", Tensor<float>({5, 5, 3}, 0.5f)).data !=
        distorted("noise_0.1", Tensor<float>({5, 5, 3}, 0.5f)).data);
}

TEST_CASE("distortion: noise has the standard deviation that its name says") {
  for (const auto& [name, want] : {std::pair{"noise_0.05", 0.05}, {"noise_0.10", 0.1}}) {
    const auto y = distorted(name, Tensor<float>({200, 200, 3}, 0.5f));
    double sum = 0, squares = 0;
    for (float v : y.data) {
      sum += static_cast<double>(v);
      squares += (static_cast<double>(v) - 0.5) * (static_cast<double>(v) - 0.5);
    }
    const double n = static_cast<double>(y.size());
    CHECK(std::abs(sum / n - 0.5) < 5 * want / std::sqrt(n));
    // The standard error is 0.2%; rounding to 8 bits adds 0.03%.
    CHECK(std::sqrt(squares / n) == Approx(want).epsilon(0.01));
  }
}

TEST_CASE("distortion: noise twice in a chain is drawn twice") {
  const auto y = distorted("noise_0.05,noise_0.05", Tensor<float>({200, 200, 3}, 0.5f));
  double squares = 0;
  for (float v : y.data) squares += (static_cast<double>(v) - 0.5) * (static_cast<double>(v) - 0.5);
  CHECK(std::sqrt(squares / static_cast<double>(y.size())) == Approx(0.05 * std::sqrt(2.0)).epsilon(0.01));
}

TEST_CASE("distortion: rotation is uniform in +-A degrees about the centre") {
  // A dot on the right of a black image reveals the angle.
  Tensor<float> x({101, 101, 3});
  for (Index i = 48; i <= 52; ++i)
    for (Index j = 88; j <= 92; ++j) x[(i * 101 + j) * 3] = 1;
  double least = 180, most = -180, sum = 0;
  for (std::uint64_t index = 0; index < 200; ++index) {
    const auto y =
        apply_distortion(parse_distortion("rotation_30"), x, kRng, index, std::vector<float>{0, 0, 0});
    double weight = 0, across = 0, up = 0;
    for (Index p = 0; p < 101 * 101; ++p) {
      weight += static_cast<double>(y[p * 3]);
      across += static_cast<double>(y[p * 3]) * static_cast<double>(p % 101 - 50);
      up -= static_cast<double>(y[p * 3]) * static_cast<double>(p / 101 - 50);
    }
    CHECK(std::hypot(across, up) / weight == Approx(40).margin(0.1));
    const double degrees = std::atan2(up, across) * 180 / std::numbers::pi;
    least = std::min(least, degrees);
    most = std::max(most, degrees);
    sum += degrees;
  }
  CHECK((least > -30.1 && least < -29 && most < 30.1 && most > 29));
  CHECK(std::abs(sum / 200) < 4 * 17.3 / std::sqrt(200.0));
}

TEST_CASE("distortion: rotation fills the corners with the background") {
  const auto y = apply_distortion(parse_distortion("rotation_180"), Tensor<float>({20, 60, 3}, 0.2f), kRng, 0,
                                  std::vector<float>{1, 0, 0.6f});
  CHECK(y.shape == Shape{20, 60, 3});
  CHECK((y[0] == 1 && y[1] == 0 && y[2] == 0.6f));
}

TEST_CASE("distortion: scale with the filters of image programs, rounded") {
  const auto x = image({40, 31, 3});
  for (const auto& [name, filter] : {std::pair{"scale-nearest_0.75", ResizeFilter::nearest},
                                     {"scale-bilinear_0.75", ResizeFilter::bilinear},
                                     {"scale-bicubic_0.75", ResizeFilter::bicubic},
                                     {"scale-lanczos_0.75", ResizeFilter::lanczos}})
    CHECK(distorted(name, x).data == rounded(resize_filtered(x, 30, 23, filter)).data);
}

TEST_CASE("distortion: a screenshot keeps the size and is its chain") {
  for (Shape s : {Shape{200, 160, 3}, Shape{48, 48, 3}}) {
    const auto x = image(s);
    const auto y = distorted("screenshot", x);
    CHECK(y.shape == x.shape);
    CHECK(y.data == distorted("scale-bicubic_1.25,blur_0.5,gamma_1.1,scale-lanczos_0.8,jpeg_80", x).data);
  }
}

TEST_CASE("distortion: contrast and greyscale") {
  const Tensor<float> x({1, 2, 3}, {0.2f, 0.4f, 0.8f, 1.f, 0.f, 0.6f});
  const auto strong = distorted("contrast_1.5", x), grey = distorted("greyscale", x);
  const float want[6] = {0.05f, 0.35f, 0.95f, 1.f, 0.f, 0.65f};
  for (Index i = 0; i < 6; ++i) CHECK(std::abs(strong[i] - want[i]) <= 0.5001f / 255);
  for (Index c = 0; c < 3; ++c) {
    CHECK(std::abs(grey[c] - 0.3858f) <= 0.5001f / 255);
    CHECK(std::abs(grey[3 + c] - 0.3674f) <= 0.5001f / 255);
  }
}

TEST_CASE("distortion: scale and blur are the layer's, rounded") {
  const auto x = image({40, 31, 3});
  const auto scaled = distorted("scale_0.75", x);
  CHECK(scaled.shape == Shape{30, 23, 3});
  CHECK(
      scaled.data ==
      rounded(op_result<float>([](auto&, auto v) { return distort::resize_area(v[0], 30, 23); }, {x})).data);
  const auto soft =
      op_result<float>([](auto&, auto v) { return distort::blur(v[0], v[1]); }, {x, number<float>(1)});
  CHECK(distorted("blur_1", x).data == rounded(soft).data);
}

TEST_CASE("distortion: crop keeps a window of the right area anywhere in the image") {
  const auto x = coordinates(60, 100);
  std::set<long> tops, lefts;
  for (std::uint64_t index = 0; index < 300; ++index) {
    const auto y = distorted("crop_0.40", x, index);
    const Index h = y.shape[0], w = y.shape[1];
    CHECK(std::abs(static_cast<double>(h * w) / 6000 - 0.4) < 0.004);
    CHECK(static_cast<double>(w) / static_cast<double>(h) == Approx(100. / 60).epsilon(0.03));
    const long left = std::lround(y[0] * 255), top = std::lround(y[1] * 255);
    CHECK((std::lround(y[(h * w - 1) * 3] * 255) == left + w - 1 &&
           std::lround(y[(h * w - 1) * 3 + 1] * 255) == top + h - 1));
    tops.insert(top);
    lefts.insert(left);
  }
  // 23 and 38 positions: 300 windows reach both ends and nearly all positions between.
  CHECK((*tops.begin() == 0 && *tops.rbegin() == 22 && tops.size() == 23));
  CHECK((*lefts.begin() <= 1 && *lefts.rbegin() >= 36 && lefts.size() > 34));
}

TEST_CASE("distortion: where pixels come from, checked on an image of coordinates") {
  // Smooth coordinates in red and green: reading bilinearly at the source reproduces the distorted image.
  const Index h = 90, w = 120;
  Tensor<float> x({h, w, 3});
  for (Index p = 0; p < h * w; ++p) {
    x[3 * p] = static_cast<float>(p % w + 10) / 255;
    x[3 * p + 1] = static_cast<float>(p / w + 10) / 255;
    x[3 * p + 2] = 1;
  }
  for (const char* name :
       {"noise_0", "crop_0.4", "rotation_40", "scale_0.5", "scale-bicubic_1.7", "scale_0.7",
        "crop_0.5,rotation_30,scale_0.8", "rotation_30,crop_0.6,scale-lanczos_1.3"}) {
    distort::PixelMap map;
    const auto y = apply_distortion(parse_distortion(name), x, kRng, 5, std::vector<float>{0, 0, 0}, &map);
    const distort::PixelMap back = map.inverse();
    double worst = 0, inside = 0;
    for (Index i = 6; i < y.shape[0] - 6; ++i)
      for (Index j = 6; j < y.shape[1] - 6; ++j) {
        const float* got = y.data.data() + 3 * (i * y.shape[1] + j);
        const auto from = map(static_cast<double>(j), static_cast<double>(i));
        // Corners opened by a rotation, and pixels next to them, hold no coordinates.
        if (from[0] < 9 || from[0] > static_cast<double>(w) - 10 || from[1] < 9 ||
            from[1] > static_cast<double>(h) - 10 || got[2] < 0.999f)
          continue;
        inside += 1;
        for (const double e : {std::abs(255 * static_cast<double>(got[0]) - 10 - from[0]),
                               std::abs(255 * static_cast<double>(got[1]) - 10 - from[1])})
          raise_to(worst, e);
        const auto again = back(from[0], from[1]);
        CHECK(std::hypot(again[0] - static_cast<double>(j), again[1] - static_cast<double>(i)) < 1e-9);
      }
    INFO(name);
    CHECK(inside > 500);
    // Half a level of rounding per step: measured 0.5 for one step, at most 1.11 for three.
    CHECK(worst < 1.3);
  }
}

TEST_CASE("distortion: jpeg costs more at a lower quality and halves chroma's resolution") {
  const auto x = image({64, 48, 3});
  double errors[3] = {};
  const char* names[3] = {"jpeg_90", "jpeg_50", "jpeg_10"};
  for (int k = 0; k < 3; ++k) {
    const auto y = distorted(names[k], x);
    REQUIRE(y.shape == x.shape);
    for (Index i = 0; i < x.size(); ++i) errors[k] += std::pow(static_cast<double>(y[i] - x[i]), 2);
  }
  CHECK((errors[0] < errors[1] && errors[1] < errors[2]));
  // Columns alternate between red and blue of the same luma (0.299 r = 0.114 b + 0.587 g): 4:2:0 blends their
  // chroma.
  Tensor<float> stripes({32, 32, 3});
  for (Index p = 0; p < 32 * 32; ++p) {
    stripes[p * 3] = p % 2 ? 0.4f : 0.f;
    stripes[p * 3 + 2] = p % 2 ? 0.f : 0.9f;
    stripes[p * 3 + 1] = p % 2 ? 0.f : 0.029f;
  }
  const auto blended = distorted("jpeg_90", stripes);
  const Index middle = (16 * 32 + 16) * 3;
  CHECK(std::abs(blended[middle] - blended[middle + 3]) < 0.1f);
  CHECK(std::abs(blended[middle + 2] - blended[middle + 5]) < 0.15f);
}

TEST_CASE("distortion: gamma, brightness and hue") {
  const Tensor<float> x({1, 2, 3}, {0.2f, 0.4f, 0.8f, 1.f, 0.f, 0.6f});
  const auto dark = distorted("gamma_2", x), bright = distorted("brightness_1.5", x);
  for (Index i = 0; i < 6; ++i) {
    CHECK(std::abs(dark[i] - x[i] * x[i]) <= 0.5001f / 255);
    CHECK(std::abs(bright[i] - std::min(1.f, 1.5f * x[i])) <= 0.5001f / 255);
  }
  // A third of a turn moves red to green, green to blue, blue to red; the turn back is the inverse.
  const auto third = distorted("hue_120", x), back = distorted("hue_-120", x), half = distorted("hue_180", x);
  for (Index i = 0; i < 6; i += 3)
    for (Index c = 0; c < 3; ++c) {
      CHECK(third[i + (c + 1) % 3] == Approx(x[i + c]).margin(1e-6));
      CHECK(back[i + c] == Approx(x[i + (c + 1) % 3]).margin(1e-6));
      // Half a turn mirrors each channel within the pixel's range.
      const float low = std::min({x[i], x[i + 1], x[i + 2]}), high = std::max({x[i], x[i + 1], x[i + 2]});
      CHECK(half[i + c] == Approx(low + high - x[i + c]).margin(1e-6));
    }
  const auto grey = distorted("hue_77", Tensor<float>({1, 1, 3}, 0.6f));
  CHECK(grey.data == std::vector<float>(3, 0.6f));
}

TEST_CASE("distortion: webp costs more at a lower quality, and without its library names the package") {
  const auto x = image({40, 33, 3});
  if (!is_built_in(ImageFormat::webp)) {
    CHECK_THROWS_WITH(parse_distortion("webp_50"), Contains("install libwebp-dev and build again"));
    library_or_skip(false, "the test of webp_A", "libwebp-dev");
    return;
  }
  const auto loss = [&](const char* name) {
    const auto y = distorted(name, x);
    CHECK(y.shape == x.shape);
    CHECK(rounded(y).data == y.data);
    double sum = 0;
    for (Index i = 0; i < x.size(); ++i) sum += std::pow(static_cast<double>(x[i] - y[i]), 2);
    return sum;
  };
  CHECK(loss("webp_95") < loss("webp_50"));
  CHECK(loss("webp_50") < loss("webp_5"));
  CHECK(distorted("webp_50,blur_1", x).data == distorted("blur_1", distorted("webp_50", x)).data);
}

TEST_CASE("distortion: a clip is apart from single images") {
  CHECK_THROWS_WITH(
      parse_distortion("blur_1,h264_28"),
      Contains("h264 needs a clip, images in order") && Contains("'blur_1,h264_28' is for single images"));
  const auto chain = distort::parse_clip_distortion("noise_0.1,blur_1,h264_28,h264_0,noise_0.1");
  CHECK(distort::needs_clip(chain));
  CHECK_THROWS_AS(apply_distortion(chain, image({8, 8, 3}), kRng, 0, kWhite), ValueError);
  const auto stages = distort::clip_stages(chain);
  REQUIRE(stages.size() == 4);
  const std::size_t sizes[] = {2, 1, 1, 1}, first[] = {0, 2, 3, 4};
  for (std::size_t i = 0; i < 4; ++i) {
    CHECK(stages[i].steps.size() == sizes[i]);
    CHECK(stages[i].first == first[i]);
    CHECK(distort::needs_clip(stages[i]) == (i == 1 || i == 2));
  }
  CHECK(distort::clip_stages(parse_distortion("combined")).size() == 1);
  // Alone, the last step draws the same random numbers as in the chain.
  const auto x = image({16, 12, 3});
  const distort::Distortion both = parse_distortion("noise_0,noise_0.1");
  const distort::Distortion second{.name = both.name, .steps = {both.steps[1]}, .first = 1};
  CHECK(apply_distortion(second, x, kRng, 3, kWhite).data == apply_distortion(both, x, kRng, 3, kWhite).data);
  CHECK(apply_distortion(second, x, kRng, 3, kWhite).data != distorted("noise_0.1", x, 3).data);
}
