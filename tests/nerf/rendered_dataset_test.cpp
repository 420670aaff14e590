#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/rendered_dataset.h>

#include <cmath>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/worst.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

TEST_CASE("rendered_dataset: over the background its images are the field's") {
  RadianceField field = small_field();
  const auto cameras = make_cameras(field.cameras, CameraSet::novel, 3, 24, 1);
  for (const Background background : {Background::white, Background::black}) {
    field.background = background;
    const Dataset data = rendered_dataset(field, cameras);
    REQUIRE(data.views.size() == 3);
    CHECK((data.split == "train" && data.layout == Layout::blender && data.background == background));
    Renderer renderer(field);
    for (std::size_t i = 0; i < 3; ++i) {
      const Rendering r = renderer.render(cameras[i]);
      const View& v = data.views[i];
      CHECK(v.camera.fx == cameras[i].fx);
      CHECK(v.rgba.data == quantize8(v.rgba).data);
      const Tensor<float> again = composited(v, background);
      double worst = 0;
      for (Index k = 0; k < again.size(); ++k)
        raise_to(worst, std::abs(static_cast<double>(again[k] - r.rgb[k])));
      // Half a level of the colour, half a level of alpha times a difference of at most 1.
      CHECK(worst < 1.01 / 255);
      for (Index p = 0; p < r.opacity.size(); ++p)
        CHECK(std::abs(v.rgba[4 * p + 3] - r.opacity[p]) < 0.502f / 255);
    }
  }
}

TEST_CASE("rendered_dataset: other spaces have opaque images, and errors, progress and threads") {
  RadianceField field = small_field();
  const auto cameras = make_cameras(field.cameras, CameraSet::novel, 2, 24, 1);
  const ScopedThreads serial(1);
  const Dataset one = rendered_dataset(field, cameras);
  const ScopedThreads parallel(2);
  CHECK(rendered_dataset(field, cameras).views[1].rgba.data == one.views[1].rgba.data);
  CHECK_THROWS_WITH(rendered_dataset(field, {}), "[rendered_dataset] cameras must be at least one, got 0");
  CHECK_THROWS_WITH(rendered_dataset(field, std::vector<Camera>{cameras[0], cameras[1].scaled(20)}),
                    "[rendered_dataset] cameras must be of one size, 24 x 18, got 20 x 15");
  Index done = 0;
  CHECK_THROWS_WITH(rendered_dataset(field, cameras,
                                     [&](Index d, Index total) {
                                       CHECK(total == 2);
                                       done = d;
                                       return false;
                                     }),
                    "stopped while rendering a data set");
  CHECK(done == 1);
  field.space.kind = SpaceKind::contracted;
  const Dataset open = rendered_dataset(field, cameras);
  CHECK(open.layout == Layout::transforms);
  CHECK(open.scene == SceneType::place);
  for (Index p = 3; p < open.views[0].rgba.size(); p += 4) CHECK(open.views[0].rgba[p] == 1);
}
