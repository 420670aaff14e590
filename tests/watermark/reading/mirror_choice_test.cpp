#include "mirror_choice.h"

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("mirror_choice: objects are tried mirrored at agreements that symmetric ones reach") {
  const auto object = nerf::SpaceKind::cube;
  CHECK(is_side_doubtful(0.9, object));
  CHECK(is_side_doubtful(0.963, object));  // a mirrored view of chair at a wrong camera
  CHECK_FALSE(is_side_doubtful(0.98, object));
  for (const auto scene : {nerf::SpaceKind::contracted, nerf::SpaceKind::ndc}) {
    CHECK(is_side_doubtful(0.949, scene));
    CHECK_FALSE(is_side_doubtful(0.963, scene));
  }
}
