#include <fieldmark/tools/bench/data_forms.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
nerf::Dataset written(const DataForm& form, const TemporaryFolder& folder) {
  const auto place = folder / form.name;
  std::filesystem::create_directories(place);
  form.write(place);
  return nerf::load_dataset(place, {.split = "train"});
}
const nerf::SceneOptions kOptions{.size = 32, .views = 12};
nerf::Dataset train() { return nerf::make_scene(kOptions, "train"); }
nerf::Dataset test() { return nerf::make_scene(kOptions, "test"); }

// The built-in scene before a backdrop with a pattern.
nerf::Dataset place(const std::string& split) {
  nerf::Dataset data = nerf::make_scene(kOptions, split);
  for (std::size_t v = 0; v < data.views.size(); ++v)
    for (Index p = 0; p < 32 * 32; ++p) {
      float* rgba = &data.views[v].rgba.data[at(4 * p)];
      const double pattern =
          0.5 + 0.4 * std::sin(0.3 * static_cast<double>(p % 32 + p / 32) + static_cast<double>(v));
      for (int k = 0; k < 3; ++k) rgba[k] = rgba[k] * rgba[3] + static_cast<float>(pattern) * (1 - rgba[3]);
      rgba[3] = 1;
    }
  return data;
}
}  // namespace

TEST_CASE("data_forms: an object's forms show the same, and their cameras stand where they should") {
  const TemporaryFolder folder;
  const DataGroup group = object_forms(train(), test());
  REQUIRE(group.forms.size() == 4);
  CHECK(group.test.size() == test().views.size());
  const nerf::Dataset plain = written(group.forms[0], folder), opaque = written(group.forms[1], folder);
  CHECK(plain.views.size() == 12);
  CHECK(plain.scene == nerf::SceneType::object);
  const nerf::Dataset scene = train();
  for (const DataForm& form : group.forms) {
    CAPTURE(form.name);
    const nerf::Dataset data = written(form, folder);
    REQUIRE(data.views.size() == scene.views.size());
    for (std::size_t v = 0; v < scene.views.size(); ++v) {
      const auto shown = nerf::composited(data.views[v], nerf::Background::white),
                 truth = nerf::composited(scene.views[v], nerf::Background::white);
      REQUIRE(shown.shape == truth.shape);
      double worst = 0;
      for (Index i = 0; i < truth.size(); ++i)
        raise_to(worst, std::abs(static_cast<double>(shown[i] - truth[i])));
      CHECK(worst < 1.01 / 255);  // colour and opacity, each half a step off
      CHECK(std::ranges::min(truth.data) < 0.9f);
    }
  }
  CHECK(opaque.scene == nerf::SceneType::plain);
  for (const std::size_t k : {2u, 3u}) {
    const nerf::Dataset moved = written(group.forms[k], folder);
    for (std::size_t axis = 0; axis < 3; ++axis)
      CHECK(std::abs(moved.views[0].camera.position()[axis] - plain.views[0].camera.position()[axis] -
                     group.forms[k].moved[axis]) < 1e-8);
    CHECK(std::hypot(group.forms[k].moved[0], group.forms[k].moved[1], group.forms[k].moved[2]) ==
          (k == 2 ? 5e5 : 1e7));
  }
}

TEST_CASE("data_forms: a place's forms have the images of its split, and what is masked is not valid") {
  const TemporaryFolder folder;
  const DataGroup group = place_forms(place("train"), place("test"));
  int masks = 0, borders = 0;
  for (const DataForm& form : group.forms) {
    CAPTURE(form.name);
    const nerf::Dataset data = written(form, folder);
    CHECK(data.views.size() == 12);
    CHECK(data.scene == nerf::SceneType::place);
    CHECK((form.most_loss == 0) == (&form == group.forms.data()));
    const bool masked = form.name == "an obstacle behind masks",
               bordered = form.name == "a transparent border";
    masks += masked;
    borders += bordered;
    const auto& valid = data.views[0].valid;
    if (masked) CHECK((!valid.empty() && valid[at(19 * 32 + 16)] == 0 && valid[at(3 * 32 + 16)] == 1));
    if (bordered) CHECK((!valid.empty() && valid[0] == 0));
  }
  CHECK((masks == 1 && borders == 1));
  const JudgedView& view = group.test.front();
  CHECK(view.counted[19 * 32 + 16] == 0);
  CHECK(view.counted[0] == 0);
  CHECK(view.counted[6 * 32 + 16] == 1);
}

TEST_CASE("data_forms: lenses are read back as pinholes that show the scene") {
  const TemporaryFolder folder;
  const DataGroup group = lens_forms({.size = 64, .views = 2});
  REQUIRE(group.forms.size() == 3);
  CHECK(group.test.front().camera.width == 52);
  for (const DataForm& form : group.forms) {
    CAPTURE(form.name);
    const nerf::Dataset data = written(form, folder);
    REQUIRE(data.views.size() == 2);
    const nerf::View& view = data.views.front();
    const auto truth = nerf::render_scene({.size = 64, .views = 2}, view.camera);
    double error = 0;
    const Index width = view.camera.width, height = view.camera.height;
    for (Index y = 8; y + 8 < height; ++y)
      for (Index x = 8; x + 8 < width; ++x) {
        const Index p = 4 * (y * width + x);
        error += std::abs(static_cast<double>(view.rgba[p + 3] * view.rgba[p] - truth[p + 3] * truth[p]));
      }
    CHECK(error / static_cast<double>((height - 16) * (width - 16)) < 0.03);
  }
}
