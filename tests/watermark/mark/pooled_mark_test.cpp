#include <fieldmark/core/error.h>

#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("pooled_mark: slots are one for each bit, of equal area") {
  for (Index bits : {1, 8, 9, 16, 48, 256}) {
    const CellGrid slots = message_slots(bits);
    REQUIRE(slots.count() == bits);
    for (double a : slots.area()) CHECK(a == Approx(1.0 / static_cast<double>(bits)));
  }
  CHECK_THROWS_WITH(message_slots(0), "[message_slots] bits must be at least 1, got 0");
  CHECK_THROWS_WITH(Owner(small_field(), small_owner_options(), test_key(1), message_slots(4), fusion_mark()),
                    "[owner] cells must be message_slots(bits) for a mark without cells: 3, got 4");
}

TEST_CASE("pooled_mark: an image confirms its own reading more than inverted bits would") {
  const Owner owner = small_paper_owner();
  const auto image = uniform<float>({32, 32, 3}, 0, 1, 1);
  const auto logits = owner.mark().evidence(owner, image, nullptr);
  double want = 0;
  for (const double s : logits) want += std::log1p(std::exp(-std::abs(s))) / 3;
  Tape<float> tape;
  CHECK(owner.mark().confirmation(owner, image)(tape.constant(image)).value()[0] == Approx(want));
  CHECK_THROWS_WITH(
      owner.mark().carrier(Params<float>(owner.params, nullptr), tape.constant(image), tape.constant(image)),
      "[carriers] owner must have cells in space, got one of preset paper");
}
