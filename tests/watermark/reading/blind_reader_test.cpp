#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/watermark/mark/object_window.h>
#include <fieldmark/watermark/reading/blind_reader.h>

#include <cmath>
#include <limits>

#include "support/catch.h"
#include "support/worst.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
// Returns a coloured block on white, so that there is something to crop.
Tensor<float> block(Index channels) {
  Tensor<float> image({40, 50, channels}, 1);
  const auto noise = uniform<float>({40, 50, channels}, 0, 0.8, 8);
  for (Index y = 8; y < 30; ++y)
    for (Index x = 20; x < 44; ++x)
      for (Index c = 0; c < channels; ++c)
        image[(y * 50 + x) * channels + c] = noise[(y * 50 + x) * channels + c];
  return image;
}

// Converts [H, W, 1 or 2] to [H, W, 3 or 4].
Tensor<float> coloured(const Tensor<float>& grey) {
  const Index in = grey.shape[2], out = in + 2;
  Tensor<float> image({grey.shape[0], grey.shape[1], out});
  for (Index p = 0; p < grey.shape[0] * grey.shape[1]; ++p) {
    for (Index c = 0; c < 3; ++c) image[p * out + c] = grey[p * in];
    if (in == 2) image[p * out + 3] = grey[p * in + 1];
  }
  return image;
}
}  // namespace

TEST_CASE("blind_reader: evidence is the window's sign evidence, summed by loops") {
  OwnerOptions options = small_owner_options();
  SECTION("of a square") {}
  SECTION("of an upright window") { options.reader_aspect = 0.5; }
  const Owner owner = small_owner(options);
  const PatchSize patch = owner.options().patch();
  const Tensor<float> image = block(3);
  const auto got = BlindReader(owner).evidence(image);
  const Index cells = owner.cells.count(), classes = cells + 1;
  REQUIRE(static_cast<Index>(got.size()) == cells);
  const Tensor<float> cut = cut_window(image, object_window(image, 1, patch.aspect()), patch, 1);
  Tape<float> tape;
  const auto out =
      cell_mark_of(owner).reader()(Params<float>(owner.params, nullptr),
                                   tape.constant(cut.data.data(), {1, patch.height, patch.width, 3}));
  std::vector<double> want(static_cast<std::size_t>(cells)), share(want.size());
  for (Index p = 0; p < out.height * out.width; ++p) {
    const float* logit = out.index.value() + p * classes;
    double sum = 0;
    for (Index c = 0; c < classes; ++c) sum += std::exp(static_cast<double>(logit[c]));
    for (Index c = 0; c < cells; ++c) {
      const double q = std::exp(static_cast<double>(logit[c])) / sum;
      want[static_cast<std::size_t>(c)] += q * std::tanh(static_cast<double>(out.sign.value()[p]) / 2);
      share[static_cast<std::size_t>(c)] += q;
    }
  }
  double most = 0;
  for (std::size_t c = 0; c < want.size(); ++c) {
    CHECK(got[c] == Approx(want[c] / std::pow(share[c] + 0.25, 0.3)).epsilon(1e-5).margin(1e-9));
    raise_to(most, std::abs(got[c]));
  }
  CHECK(most > 1e-4);
}

TEST_CASE("blind_reader: for preset paper the evidence is the window's logits") {
  const Owner owner = small_paper_owner();
  const Tensor<float> image = block(3), cut = cut_window(image, object_window(image, 1), square_patch(32), 1);
  Tape<float> tape;
  const auto logits = fusion_mark_of(owner).reader()(Params<float>(owner.params, nullptr),
                                                     tape.constant(cut.data.data(), {1, 32, 32, 3}));
  CHECK(BlindReader(owner).evidence(image) == std::vector<double>(logits.value(), logits.value() + 3));
}

TEST_CASE("blind_reader: grey is repeated and alpha is laid over the field's background") {
  Owner owner = small_owner();
  const BlindReader reader(owner);
  const Tensor<float> grey = block(1), grey_alpha = block(2), alpha = block(4);
  CHECK(reader.evidence(grey) == reader.evidence(coloured(grey)));
  CHECK(reader.evidence(grey_alpha) == reader.evidence(coloured(grey_alpha)));
  for (float background : {1.f, 0.f}) {
    owner.field.background = background > 0 ? nerf::Background::white : nerf::Background::black;
    Tensor<float> over({40, 50, 3});
    for (Index p = 0; p < 40 * 50; ++p)
      for (Index c = 0; c < 3; ++c)
        over[3 * p + c] = alpha[4 * p + 3] * alpha[4 * p + c] + (1 - alpha[4 * p + 3]) * background;
    CHECK(reader.evidence(alpha) == reader.evidence(over));
  }
  CHECK(reader.evidence(grey) != reader.evidence(block(3)));
}

TEST_CASE("blind_reader: what surrounds the object does not matter") {
  const Owner owner = small_owner();
  const BlindReader reader(owner);
  const Tensor<float> image = block(3);
  CHECK(reader.evidence(image) == reader.evidence(cut_window(image, {-6, -10, 70, 70}, square_patch(70), 1)));
}

TEST_CASE("blind_reader: one and two threads give the same bits") {
  const Owner owner = small_owner();
  const BlindReader reader(owner);
  const ScopedThreads serial(1);
  const auto one = reader.evidence(block(3));
  const ScopedThreads parallel(2);
  const auto two = reader.evidence(block(3));
  CHECK(one == two);
}

TEST_CASE("blind_reader: errors name what is no image") {
  const Owner owner = small_owner();
  const BlindReader reader(owner);
  CHECK(reader.evidence(Tensor<float>({16, 16, 3}, 0.5f)).size() > 0);
  Tensor<float> hole({40, 50, 3}, 0.5f);
  hole[3 * (7 * 50 + 9) + 1] = std::numeric_limits<float>::quiet_NaN();
  CHECK_THROWS_WITH(reader.evidence(hole), "[blind_reader] image must be finite, got nan in row 7, column 9");
  CHECK_THROWS_AS(reader.evidence(Tensor<float>({40, 50})), ShapeError);
  CHECK_THROWS_WITH(reader.evidence(Tensor<float>({40, 50})),
                    "[blind_reader] image must have rank 3 [H, W, C], got shape [40, 50]");
  for (const Shape& shape : {Shape{15, 50, 3}, Shape{40, 15, 3}, Shape{40, 50, 5}, Shape{40, 50, 0}}) {
    CHECK_THROWS_AS(reader.evidence(Tensor<float>(shape)), ShapeError);
    CHECK_THROWS_WITH(
        reader.evidence(Tensor<float>(shape)),
        "[blind_reader] image must be [H, W, 1 to 4] with sides of at least 16, got shape " + shape.str());
  }
}
