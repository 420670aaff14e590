#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// The kind of scene that a data set shows: determines the space of its field and how it is trained.
enum class SceneType {
  object,  ///< an object whose silhouettes are the alpha of its images
  plain,   ///< an opaque object in front of a background of one colour
  place,   ///< a scene with a background of its own
  forward  ///< a scene in front of cameras that all look one way, with depth bounds
};
/// Returns "object", "plain", "place" or "forward".
std::string name_of(SceneType type);
/// Returns the four names in the order of the enumeration.
std::vector<std::string> scene_type_names();
/// @throws ValueError if name is none of them
SceneType parse_scene_type(std::string_view name);

}  // namespace fieldmark::nerf
