#include <fieldmark/core/error.h>
#include <fieldmark/watermark/embedding/mark_colours.h>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("mark_colours: names there and back, others are refused") {
  for (const MarkColours c : {MarkColours::blue, MarkColours::light})
    CHECK(parse_mark_colours(mark_colours_name(c)) == c);
  CHECK_THROWS_AS(parse_mark_colours("grey"), ValueError);
  CHECK_THROWS_WITH(parse_mark_colours("grey"), "[mark_colours] expected blue or light, got 'grey'");
}

TEST_CASE("mark_colours: light for scenes that fill their photographs, blue for objects") {
  CHECK(colours_for(nerf::SpaceKind::cube) == MarkColours::blue);
  CHECK(colours_for(nerf::SpaceKind::contracted) == MarkColours::light);
  CHECK(colours_for(nerf::SpaceKind::ndc) == MarkColours::light);
}

TEST_CASE("mark_colours: blue is what the options are by themselves, light is smooth, tilted and shaded") {
  MarkNetworkOptions mark;
  EmbedOptions embed;
  use_colours(MarkColours::light, mark, embed);
  CHECK(mark.bands < MarkNetworkOptions{}.bands);
  CHECK((mark.tilt > 0 && mark.tilt < 90));
  CHECK((mark.shading > 0 && mark.shading <= 1));
  CHECK(embed.smooth_weight == 0);
  CHECK(embed.flat_weight > EmbedOptions{}.flat_weight);
  use_colours(MarkColours::blue, mark, embed);
  CHECK(mark.bands == MarkNetworkOptions{}.bands);
  CHECK(mark.tilt == 0);
  CHECK(mark.shading == 0);
  CHECK(embed.smooth_weight == EmbedOptions{}.smooth_weight);
  CHECK(embed.flat_weight == EmbedOptions{}.flat_weight);
}
