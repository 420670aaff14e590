#include "soft_binding.h"
#include "canonical_json.h"

#include <nlohmann/json.hpp>
#include <set>

#include "support/catch.h"

using namespace fieldmark::watermark;
using Json = nlohmann::json;

TEST_CASE("soft_binding: the members that the C2PA specification names, and no others") {
  const std::string text = soft_binding_json(message_from_hex("a5c3", 16), std::string(64, 'd'));
  const Json json = Json::parse(text);
  CHECK(json.size() == 2);
  CHECK(json["label"] == "c2pa.soft-binding");
  const std::set<std::string> allowed{"alg", "blocks", "name", "alg-params", "bindingMetadata",
                                      "pad", "pad2"};
  for (const auto& [key, value] : json["data"].items()) CHECK(allowed.count(key) == 1);
  CHECK(json["data"]["alg"] == "org.fieldmark.keyed-cells.1");
  REQUIRE(json["data"]["blocks"].size() == 1);
  const Json& block = json["data"]["blocks"][0];
  CHECK(block.size() == 2);
  CHECK(block["scope"] == Json::object());
  CHECK(block["value"] == "pcM=");  // bytes a5 c3
  CHECK(json["data"]["alg-params"].is_string());
  CHECK_THAT(json["data"]["bindingMetadata"]["description"].get<std::string>(), Contains("not registered"));
  CHECK(canonical_json(text, "text") == text);
}

TEST_CASE("soft_binding: bits fill bytes from the most significant on") {
  const auto value = [](const char* hex, fieldmark::Index bits) {
    return Json::parse(soft_binding_json(message_from_hex(hex, bits), ""))["data"]["blocks"][0]["value"];
  };
  CHECK(value("8", 1) == "gA==");     // 80
  CHECK(value("a5c", 10) == "pcA=");  // a5 c0
  CHECK(value("0ff", 12) == "D/A=");  // 0f f0
}
