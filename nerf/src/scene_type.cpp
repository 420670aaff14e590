#include <fieldmark/core/error.h>
#include <fieldmark/nerf/scene_type.h>

namespace fieldmark::nerf {

std::vector<std::string> scene_type_names() { return {"object", "plain", "place", "forward"}; }

std::string name_of(SceneType type) { return scene_type_names()[static_cast<std::size_t>(type)]; }

SceneType parse_scene_type(std::string_view name) {
  const std::vector<std::string> names = scene_type_names();
  for (std::size_t i = 0; i < names.size(); ++i)
    if (name == names[i]) return static_cast<SceneType>(i);
  throw ValueError("[scene_type] name must be object, plain, place or forward, got \"" + std::string(name) +
                   "\"");
}

}  // namespace fieldmark::nerf
