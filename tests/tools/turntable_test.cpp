#include "cli/turntable.h"

#include <fieldmark/core/error.h>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::cli;

TEST_CASE("turntable: the page holds every image and names nothing outside itself", "[export]") {
  const CameraGrid grid{.rows = 1, .columns = 2, .closed = false, .cameras = {}};
  const std::vector<std::vector<std::byte>> jpegs{{std::byte{1}, std::byte{2}, std::byte{3}},
                                                  {std::byte{255}}};
  const std::string page = turntable_page(grid, jpegs, "a<b>&.fm", true);
  CHECK_THAT(page,
             Contains("const rows = 1, columns = 2, closed = false, images = [\n\"AQID\",\n\"/w==\",\n];"));
  CHECK_THAT(page, Contains("<title>a&lt;b&gt;&amp;.fm</title>"));
  CHECK_THAT(page, Contains("alt=\"View of a&lt;b&gt;&amp;.fm\""));
  CHECK(page.starts_with("<!doctype html>"));
  CHECK(page.ends_with("</html>\n"));
  CHECK(page.find("http") == std::string::npos);
  CHECK_THAT(page, Contains("background: #000"));
  CHECK_THAT(turntable_page(grid, jpegs, "", false), Contains("background: #fff"));
  CHECK_THROWS_WITH(turntable_page(grid, {jpegs[0]}, "", false),
                    "[turntable_page] jpegs must be rows x columns, 2, got 1");
}
