#include "residual_signs.h"
#include <fieldmark/distort/distortion.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/resize.h>

#include <algorithm>
#include <cmath>

#include "blurred.h"
#include "support/catch.h"
#include "support/random.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
const Message kResidualMessage{{1, 0, 0, 1}};

nerf::Camera residual_camera(Index size) {
  return nerf::make_cameras(tiny_field().cameras, nerf::CameraSet::novel, 1, size, 4).front();
}

Tensor<float> marked_image(const Owner& owner, const nerf::Camera& camera) {
  nerf::Renderer renderer(owner.field);
  renderer.set_recolour(owner.marking(cell_signs(owner.code(), kResidualMessage)));
  return quantize8(renderer.render(camera).rgb);
}

ResidualSigns signs_of(const Owner& owner, const Surround& seen, const nerf::Camera& camera) {
  nerf::Renderer renderer(owner.field);
  return residual_signs(renderer, owner, evidence_view(seen, camera, 0, owner.field.cameras));
}

// Correlation of the signs with those that the message sends.
double share_of(const Owner& owner, const std::vector<double>& sign) {
  const auto sent = cell_signs(owner.code(), kResidualMessage);
  double both = 0, power = 0, count = 0;
  for (std::size_t c = 0; c < sign.size(); ++c)
    both += sign[c] * static_cast<double>(sent[c]), power += sign[c] * sign[c], count += sign[c] != 0;
  return both / std::sqrt(power * count);
}
}  // namespace

TEST_CASE("residual_signs: the residual shows the signs that were sent, in changed colours, too") {
  const Owner owner = marking_owner();
  const nerf::Camera camera = residual_camera(96);
  Tensor<float> image = marked_image(owner, camera);
  CHECK(share_of(owner, signs_of(owner, {.image = image, .plain = {}}, camera).sign) > 0.5);
  for (float& x : image.data) x = 0.7f * x + 0.1f;
  CHECK(share_of(owner, signs_of(owner, {.image = image, .plain = {}}, camera).sign) > 0.5);
}

TEST_CASE("residual_signs: noise of lightness hides less than as much noise in every channel") {
  const Owner owner = marking_owner();
  const nerf::Camera camera = residual_camera(96);
  const auto share = [&](bool grey) {
    Tensor<float> image = marked_image(owner, camera);
    const auto noise = uniform<float>({image.size()}, -0.8f, 0.8f, 5);
    for (Index i = 0; i < image.size(); ++i) image[i] += noise[grey ? i / 3 : i];
    return share_of(owner, signs_of(owner, {.image = image, .plain = {}}, camera).sign);
  };
  const double of_grey = share(true), of_colour = share(false);
  CAPTURE(of_grey, of_colour);
  CHECK(of_grey > 0.4);
  CHECK(of_grey > 1.5 * of_colour);
}

TEST_CASE("residual_signs: cells behind covered pixels have no sign") {
  const Owner owner = marking_owner();
  const nerf::Camera camera = residual_camera(96);
  Surround seen{.image = marked_image(owner, camera), .plain = {}};
  const auto known = [&] {
    const std::vector<double> sign = signs_of(owner, seen, camera).sign;
    return std::ssize(sign) - std::ranges::count(sign, 0.0);
  };
  const Index all = known();
  seen.covered.assign(96 * 96, 0);
  CHECK(known() == all);
  std::fill_n(seen.covered.begin(), 48 * 96, std::uint8_t{1});
  CHECK(known() > 0);
  CHECK(known() < all);
  CHECK(share_of(owner, signs_of(owner, seen, camera).sign) > 0.4);
  std::ranges::fill(seen.covered, std::uint8_t{1});
  CHECK(known() == 0);
}

TEST_CASE("residual_signs: blurred and small images have lost detail") {
  const Owner owner = marking_owner();
  const nerf::Camera camera = residual_camera(96), small = residual_camera(24);
  const Tensor<float> image = marked_image(owner, camera);
  CHECK(!signs_of(owner, {.image = image, .plain = {}}, camera).lost_detail);
  CHECK(signs_of(owner, {.image = blurred(image, 2), .plain = {}}, camera).lost_detail);
  CHECK(signs_of(owner, {.image = resize_area(image, 24, 24), .plain = {}}, small).lost_detail);
  // A blur is measured in pixels of the image before it was reduced.
  nerf::Renderer renderer(owner.field);
  EvidenceView reduced =
      evidence_view({.image = blurred(image, 0.6), .plain = {}}, camera, 0, owner.field.cameras);
  CHECK(!residual_signs(renderer, owner, reduced).lost_detail);
  reduced.zoom = 2;
  CHECK(residual_signs(renderer, owner, reduced).lost_detail);
}

TEST_CASE("residual_signs: after strong JPEG, the likeliest tones and background are taken") {
  const Owner owner = marking_owner();
  const nerf::Camera camera = residual_camera(160);
  const Tensor<float> image = marked_image(owner, camera);
  const auto share_after = [&](const char* name) {
    const std::vector<float> white(3, 1.f);
    const Tensor<float> changed =
        distort::apply_distortion(distort::parse_distortion(name), image, CounterRng(1, 1), 0, white);
    const Surround seen = clear_surround(changed, 1, true);
    nerf::Camera inside = camera;
    inside.cx -= static_cast<double>(seen.left);
    inside.cy -= static_cast<double>(seen.top);
    inside.height = seen.image.shape[0];
    inside.width = seen.image.shape[1];
    return share_of(owner, signs_of(owner, seen, inside).sign);
  };
  CHECK(share_after("jpeg_10") > 0.4);  // measured 0.50, 0.66, 0.68 and 0.46
  CHECK(share_after("background_black,jpeg_30") > 0.55);
  CHECK(share_after("brightness_0.5,jpeg_50") > 0.55);
  CHECK(share_after("caption,jpeg_50") > 0.35);
}
