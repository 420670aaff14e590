#include <fieldmark/watermark/mark/cameras_around.h>

#include "support/catch.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("cameras_around: an object is seen from every direction too, a place from novel cameras alone") {
  nerf::RadianceField field = small_owner().field;
  REQUIRE(field.space.kind == nerf::SpaceKind::cube);
  const auto both = cameras_around(field, 5, 3, 16, 7);
  const auto novel = nerf::make_cameras(field.cameras, nerf::CameraSet::novel, 5, 16, 7);
  REQUIRE(both.size() == 8);
  for (std::size_t i = 0; i < novel.size(); ++i) CHECK(both[i].pose == novel[i].pose);
  const auto sphere = nerf::make_cameras(field.cameras, nerf::CameraSet::sphere, 3, 16, 7);
  for (std::size_t i = 0; i < 3; ++i) CHECK(both[5 + i].pose == sphere[i].pose);
  field.space.kind = nerf::SpaceKind::contracted;
  CHECK(cameras_around(field, 5, 3, 16, 7).size() == 5);
}
