#include <fieldmark/core/error.h>
#include <fieldmark/nerf/scene_type.h>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

TEST_CASE("scene_type: names are read back, and others are refused") {
  for (const SceneType type : {SceneType::object, SceneType::plain, SceneType::place, SceneType::forward})
    CHECK(parse_scene_type(name_of(type)) == type);
  CHECK(scene_type_names() == std::vector<std::string>{"object", "plain", "place", "forward"});
  CHECK_THROWS_WITH(parse_scene_type("room"),
                    "[scene_type] name must be object, plain, place or forward, got \"room\"");
  CHECK_THROWS_AS(parse_scene_type(""), ValueError);
}
