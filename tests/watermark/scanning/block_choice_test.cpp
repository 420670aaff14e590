#include "block_choice.h"

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

PartReading part(const PixelBox& box, double agreement, bool mirrored = false) {
  PartReading p{.box = box, .reading = {}};
  p.reading.informed.agreement = agreement;
  p.reading.mirrored = mirrored;
  return p;
}

}  // namespace

TEST_CASE("block_choice: several blocks that agree by less than 0.98 are read apart, too") {
  const ImageBlock one{{0, 0, 100, 100}, {}}, two{{0, 0, 100, 100}, {one, one}};
  ImageReading reading;
  reading.informed.agreement = 0.979;
  CHECK(is_sure(reading, one));
  CHECK_FALSE(is_sure(reading, two));
  reading.informed.agreement = 0.98;
  CHECK(is_sure(reading, two));
}

TEST_CASE(
    "block_choice: a part contradicts the whole if it agrees clearly better and one of them is mirrored") {
  const auto reading = [](double agreement, bool mirrored) { return part({}, agreement, mirrored).reading; };
  CHECK(contradicts(reading(0.98, false), reading(0.95, true)));
  CHECK(contradicts(reading(0.98, true), reading(0.95, false)));
  CHECK_FALSE(contradicts(reading(0.98, false), reading(0.95, false)));  // another part of the same view
  CHECK_FALSE(contradicts(reading(0.98, true), reading(0.95, true)));
  CHECK_FALSE(contradicts(reading(0.965, false), reading(0.95, true)));
}

TEST_CASE("block_choice: a block gives way to a part that contradicts it") {
  std::vector<PartReading> parts{part({10, 10, 50, 50}, 0.99), part({10, 70, 50, 50}, 0.9)};
  take_unless_contradicted(part({10, 10, 50, 110}, 0.95, true), parts);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].box.height == 50);
  CHECK(parts[1].box.height == 50);
}

TEST_CASE("block_choice: a block that no part contradicts replaces its parts, and no others") {
  std::vector<PartReading> parts{part({10, 10, 50, 50}, 0.96), part({10, 70, 50, 50}, 0.9),
                                 part({10, 121, 50, 50}, 0.99, true)};
  take_unless_contradicted(part({10, 10, 50, 110}, 0.95), parts);
  REQUIRE(parts.size() == 2);
  CHECK(parts[0].box.y == 121);
  CHECK(parts[1].box.height == 110);
}
