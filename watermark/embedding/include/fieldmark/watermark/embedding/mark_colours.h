#pragma once
#include <fieldmark/watermark/embedding/embedder.h>

namespace fieldmark::watermark {

/// How a mark of preset fast looks.
enum class MarkColours {
  blue,   ///< blue and yellow without luma, in fine detail: read soonest, where most of an image is
          ///< background
  light,  ///< like an uneven light on the surfaces: smooth, between blue and grey, fainter on dark colours
};

/// "blue" or "light".
const char* mark_colours_name(MarkColours colours);
/// @throws ValueError if the name is neither
MarkColours parse_mark_colours(std::string_view name);

/// What a scene needs: light where it fills its photographs (its space is contracted or ndc), which have as
/// much of the mark everywhere as an object has; blue for an object in a cube, before a plain background.
MarkColours colours_for(nerf::SpaceKind space);

/// Sets the options that make a mark look so: `mark`'s bands, tilt and shading, and `embed`'s smooth_weight
/// and flat_weight.
void use_colours(MarkColours colours, MarkNetworkOptions& mark, EmbedOptions& embed);

}  // namespace fieldmark::watermark
