#include "canonical_json.h"
#include <fieldmark/core/error.h>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("canonical_json: one text for one content") {
  const std::string text = canonical_json(
      R"({"b": [1, -2, 0.5], "a": {"z": true, "B": null}, "c": [{"x": 1e-30}, []], "d": {}, "e": 18446744073709551615})",
      "input");
  CHECK(text ==
        "{\n"
        "  \"a\": {\n"
        "    \"B\": null,\n"
        "    \"z\": true\n"
        "  },\n"
        "  \"b\": [1, -2, 5.000000000e-01],\n"
        "  \"c\": [\n"
        "    {\n"
        "      \"x\": 1.000000000e-30\n"
        "    },\n"
        "    []\n"
        "  ],\n"
        "  \"d\": {},\n"
        "  \"e\": 18446744073709551615\n"
        "}\n");
  CHECK(canonical_json(text, "input") == text);
  CHECK(canonical_json("  {\"x\" : 1.0,\"y\":-0.0 }", "input") ==
        "{\n  \"x\": 1.000000000e+00,\n  \"y\": -0.000000000e+00\n}\n");
}

TEST_CASE("canonical_json: strings keep what they say") {
  CHECK(canonical_json(R"(["\u0041\u00e9\/", "\"\\\n\u0001", "\ud83d\ude00"])", "input") ==
        "[\"A\xc3\xa9/\", \"\\\"\\\\\\n\\u0001\", \"\xf0\x9f\x98\x80\"]\n");
  CHECK(canonical_json(R"({"a": 1, "a": 2})", "input") == "{\n  \"a\": 2\n}\n");
}

TEST_CASE("canonical_json: what is no JSON is refused, and so are endless levels") {
  for (const char* bad : {"", "{", "[1,]", "{\"a\": nan}", "[1e999]", "\"\xff\"", "[] []"})
    CHECK_THROWS_AS(canonical_json(bad, "input"), IoError);
  CHECK_THROWS_WITH(canonical_json("{", "evidence.json"), Contains("evidence.json: expected JSON"));
  CHECK_THROWS_WITH(canonical_json(std::string(100000, '[') + std::string(100000, ']'), "input"),
                    "input: expected at most 32 levels of JSON");
  CHECK_NOTHROW(canonical_json(std::string(33, '[') + std::string(33, ']'), "input"));
}
