#include <fieldmark/core/error.h>
#include "lens.h"

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

TEST_CASE("intrinsics: an angle alone is make_camera") {
  const Camera a = Intrinsics{.angle_x = 0.7}.camera({}, 30, 20), b = make_camera({}, 0.7, 30, 20);
  CHECK(a.parameters() == b.parameters());
  CHECK((a.width == 30 && a.height == 20));
}

TEST_CASE("intrinsics: lengths are scaled to the image, the middle is the default") {
  const Intrinsics full{.fl_x = 100, .fl_y = 110, .cx = 60.0, .cy = 45.0, .width = 120, .height = 80};
  const Camera half = full.camera({}, 60, 40);
  CHECK((half.fx == 50 && half.fy == 55 && half.cx == 30 && half.cy == 22.5));
  const Camera as_is = Intrinsics{.fl_x = 100}.camera({}, 60, 40);
  CHECK((as_is.fx == 100 && as_is.fy == 100 && as_is.cx == 30 && as_is.cy == 20));
  const Camera angles = Intrinsics{.angle_x = 0.7, .angle_y = 0.4}.camera({}, 60, 40);
  CHECK(angles.fy == Approx(20 / std::tan(0.2)));
  // A focal length takes precedence over an angle.
  CHECK(Intrinsics{.angle_x = 0.7, .fl_x = 100}.camera({}, 60, 40).fx == 100);
}

TEST_CASE("intrinsics: an image may be off the stated proportions by its rounding only") {
  const Intrinsics full{.fl_x = 100, .width = 1009, .height = 757};
  CHECK(full.camera({}, 126, 94).width == 126);
  CHECK(full.camera({}, 127, 95).width == 127);
  CHECK_THROWS_WITH(full.camera({}, 126, 100),
                    Contains("must be of 1009 x 757 pixels as stated, or that scaled, got 126 x 100"));
  CHECK_THROWS_WITH(Intrinsics{}.camera({}, 4, 4), Contains("fl_x or angle_x must be stated"));
}
