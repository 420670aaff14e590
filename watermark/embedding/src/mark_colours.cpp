#include <fieldmark/watermark/embedding/mark_colours.h>

namespace fieldmark::watermark {

const char* mark_colours_name(MarkColours colours) {
  return colours == MarkColours::light ? "light" : "blue";
}

MarkColours parse_mark_colours(std::string_view name) {
  for (const MarkColours c : {MarkColours::blue, MarkColours::light})
    if (name == mark_colours_name(c)) return c;
  throw ValueError("[mark_colours] expected blue or light, got '" + std::string(name) + "'");
}

MarkColours colours_for(nerf::SpaceKind space) {
  return space == nerf::SpaceKind::cube ? MarkColours::blue : MarkColours::light;
}

void use_colours(MarkColours colours, MarkNetworkOptions& mark, EmbedOptions& embed) {
  const MarkNetworkOptions usual_mark;
  const EmbedOptions usual;
  const bool light = colours == MarkColours::light;
  mark.bands = light ? 5 : usual_mark.bands;  // details finer than cells cost likeness and carry nothing
  mark.tilt = light ? 50 : usual_mark.tilt;
  mark.shading = light ? 0.97 : usual_mark.shading;
  embed.smooth_weight = light ? 0 : usual.smooth_weight;  // light is smooth
  embed.flat_weight = light ? 0.8 : usual.flat_weight;    // and what is left to be seen of it is on walls
}

}  // namespace fieldmark::watermark
