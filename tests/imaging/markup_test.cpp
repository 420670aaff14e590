#include <fieldmark/imaging/markup.h>

#include "support/catch.h"

using namespace fieldmark::bench;

TEST_CASE("markup: what could begin a tag, an entity or end an attribute is escaped") {
  CHECK(escaped_markup("a<b>&\"c\" 'd'") == "a&lt;b&gt;&amp;&quot;c&quot; &#39;d&#39;");
  CHECK(escaped_markup("&lt;") == "&amp;lt;");
  CHECK(escaped_markup("caf\xc3\xa9\t1\n2") == "caf\xc3\xa9\t1\n2");
  CHECK(escaped_markup(std::string_view("a\0b\x1b", 4)) ==
        "a\xef\xbf\xbd"
        "b\xef\xbf\xbd");
  CHECK(escaped_markup("") == "");
}
