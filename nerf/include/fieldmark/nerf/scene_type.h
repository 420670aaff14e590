#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// The kind of scene that a data set shows: decides the space of its field and how it is trained.
enum class SceneType {
  object,  ///< an object whose silhouettes are in the alpha of its images
  plain,   ///< an opaque object before a background of one colour
  place,   ///< a scene with a background of its own
  forward  ///< a scene before cameras that all look one way, with bounds of its depth
};
/// "object", "plain", "place" or "forward".
std::string name_of(SceneType type);
/// The four names, in the order of the enumeration.
std::vector<std::string> scene_type_names();
/// @throws ValueError if name is none of them
SceneType parse_scene_type(std::string_view name);

}  // namespace fieldmark::nerf
