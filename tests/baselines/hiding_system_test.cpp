#include "hiding_system.h"
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/analytic_scene.h>

#include "nerf/small_field.h"
#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

namespace {
std::shared_ptr<const ImageMarker> marker() {
  return std::make_shared<ImageMarker>(HidingKind::hidden, HidingOptions{.bits = 6, .channels = 4}, 1);
}
}  // namespace

TEST_CASE("hiding_system: which systems have a 2-D network") {
  CHECK(hiding_system("hidden_nerf")->kind == HidingKind::hidden);
  CHECK(!hiding_system("hidden_nerf")->renders);
  CHECK(hiding_system("nerf_mbrs")->kind == HidingKind::mbrs);
  CHECK(hiding_system("nerf_mbrs")->renders);
  CHECK(!hiding_system("ours"));
}

TEST_CASE("hiding_system: marked images keep what is transparent, and their mark PSNR") {
  const nerf::Dataset data = nerf::make_scene({.size = 32, .views = 2});
  const auto net = marker();
  const watermark::Message message{{1, 0, 1, 1, 0, 0}};
  const nerf::Dataset marked = marked_images(data, *net, message, 26);
  REQUIRE(marked.views.size() == data.views.size());
  for (std::size_t v = 0; v < data.views.size(); ++v) {
    const auto& before = data.views[v].rgba;
    const auto& after = marked.views[v].rgba;
    const auto want = net->mark(nerf::composited(data.views[v], data.background), message, 26);
    Index opaque = 0, clear = 0;
    for (Index p = 0; p < before.size() / 4; ++p) {
      CHECK(before[4 * p + 3] == after[4 * p + 3]);
      opaque += before[4 * p + 3] == 1;
      clear += before[4 * p + 3] == 0;
      for (Index c = 0; c < 3; ++c) {
        if (before[4 * p + 3] == 0) CHECK(after[4 * p + c] == before[4 * p + c]);
        if (before[4 * p + 3] == 1) CHECK(after[4 * p + c] == want[3 * p + c]);
      }
    }
    CHECK((opaque > 50 && clear > 50));
    CHECK(before.data != after.data);
    // Over the whole image, the mark is at most as strong as requested, because the background's part is
    // lost.
    CHECK(psnr(nerf::composited(marked.views[v], data.background),
               nerf::composited(data.views[v], data.background)) > 25.5);
  }
}

TEST_CASE("hiding_system: two fields shown in turns with a message and its opposite") {
  const auto field = std::make_shared<const nerf::RadianceField>(small_field());
  const auto other = std::make_shared<const nerf::RadianceField>(small_field(2));
  const watermark::Message message{{1, 0, 1, 1, 0, 0}};
  CHECK(opposite(message) == watermark::Message{{0, 1, 0, 0, 1, 1}});
  const MarkedScene scene = marked_scene(marker(), {field, other}, message);
  CHECK(scene.message(0) == message);
  CHECK(scene.message(3) == opposite(message));
  const auto camera = nerf::make_cameras(field->cameras, nerf::CameraSet::novel, 1, 0, 5).front();
  CHECK(scene.render(camera, message).data == nerf::Renderer(*field).render(camera).rgb.data);
  CHECK(scene.render(camera, opposite(message)).data == nerf::Renderer(*other).render(camera).rgb.data);
  // A constant reading gets half of the bits right over a message and its opposite together.
  const Tensor<float> grey({16, 16, 3}, 0.5f);
  CHECK(scene.accuracy(grey, message) + scene.accuracy(grey, opposite(message)) == Approx(1));
}

TEST_CASE("hiding_system: marks on renders, and on its own images") {
  const auto field = std::make_shared<const nerf::RadianceField>(small_field());
  const auto net = marker();
  const MarkedScene scene = marked_renders(net, field, 3, 28);
  const auto camera = nerf::make_cameras(field->cameras, nerf::CameraSet::novel, 1, 0, 5).front();
  const auto render = nerf::Renderer(*field).render(camera).rgb;
  CHECK(scene.message(2) == message_of_view(6, 3, 2));
  CHECK(psnr(scene.render(camera, scene.message(2)), render) == Approx(28).margin(1));
  const auto own = own_scores(*net, CropSource({render}, 1), 3, 16, 1, 28);
  CHECK(own.psnr == Approx(28).margin(1));
  const CropSource crops({render}, 1);
  double by_hand = 0;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto sent = watermark::random_message(6, CounterRng(1, 43), i);
    by_hand += accuracy_of(*net, {net->mark(crops.crop(16, i), sent, 28)}, sent) / 3;
  }
  CHECK(own.accuracy == Approx(by_hand));
  const auto read = net->read(render);
  CHECK(accuracy_of(*net, {render, render}, read) == 1);
  CHECK(accuracy_of(*net, {render}, opposite(read)) == 0);
  CHECK_THROWS_WITH(accuracy_of(*net, {}, read), "[accuracy_of] images must not be empty");
  CHECK_THROWS_WITH(own_scores(*net, CropSource({render}, 1), 0, 16, 1),
                    "[own_scores] count must be at least 1, got 0");
}
