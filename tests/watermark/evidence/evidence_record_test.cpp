#include <fieldmark/core/error.h>
#include <fieldmark/watermark/evidence/evidence_record.h>
#include "canonical_json.h"

#include <limits>
#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "watermark/small_evidence.h"

using namespace fieldmark;
using namespace fieldmark::watermark;
using Json = nlohmann::json;

namespace {
const std::map<std::string, std::string> kFiles{{"report.html", std::string(64, 'f')}};

std::string small_text() { return evidence_json(small_evidence(), public_key(test_key(5)), kFiles); }

// Returns the text with one entry replaced.
std::string changed(const char* pointer, const Json& value) {
  Json json = Json::parse(small_text());
  json[Json::json_pointer(pointer)] = value;
  return canonical_json(json.dump(), "changed");
}
}  // namespace

TEST_CASE("evidence_record: the text holds what the record says, and reads back") {
  const EvidenceRecord record = small_evidence();
  REQUIRE(record.found());
  const std::string text = small_text();
  CHECK(text == small_text());
  CHECK(canonical_json(text, "text") == text);
  const EvidenceSummary s = parse_evidence(text, "evidence.json");
  CHECK(s.signer == public_key(test_key(5)));
  CHECK(s.owner_sha256 == record.owner_sha256);
  CHECK(s.commitment == record.commitment);
  CHECK(s.message == record.message);
  CHECK(s.found);
  CHECK(s.fpr == record.fpr);
  CHECK(s.p_value == Approx(record.together.p_value).epsilon(1e-9));
  CHECK(s.files == kFiles);
  REQUIRE(s.images.size() == 2);
  CHECK(s.images[1].name == "view_1.png");
  CHECK(s.images[1].sha256 == std::string(64, '1'));
  REQUIRE(s.controls.size() == 2);
  CHECK(s.controls[1].name == "cat.jpg");
}

TEST_CASE("evidence_record: a copy and networks that know the key are named") {
  EvidenceRecord record = small_evidence();
  const auto read = [&] {
    return parse_evidence(evidence_json(record, public_key(test_key(5)), kFiles), "e");
  };
  CHECK(read().copy.empty());
  CHECK(read().key_free);
  record.copy = "Studio A";
  record.key_free = false;
  CHECK(read().copy == "Studio A");
  CHECK_FALSE(read().key_free);
}

TEST_CASE("evidence_record: the members of the text are these") {
  const Json json = Json::parse(small_text());
  std::string names;
  for (const auto& [key, value] : json.items()) names += key + " ";
  CHECK(names ==
        "cells claim commit controls files format found fpr isa message message_bits owner_sha256 pictures "
        "public_key reading seed together wrong_keys ");
  names = "";
  for (const auto& [key, value] : json["pictures"][0].items()) names += key + " ";
  CHECK(names ==
        "bits confidences decided_bits height logits matching_bits name p_value p_value_bits "
        "p_value_bits_two_sided p_value_two_sided sha256 statistic width ");
  CHECK(json["format"] == "fieldmark evidence 1");
  CHECK(json["message"] == "b");
  CHECK(json["pictures"][0]["bits"] == "1011");
  CHECK(json["wrong_keys"]["n"] == 200);
  CHECK(json["wrong_keys"]["counts"].size() == 8);
  CHECK(json["wrong_keys"]["intervals_99"]["1e-1"] == Json{10, 32});  // Python's fractions
  CHECK(json["wrong_keys"]["intervals_99"]["1e-8"] == Json{0, 0});
  Index keys = 0;
  for (const Json& count : json["wrong_keys"]["histogram"]) keys += count.get<Index>();
  CHECK(keys == 200);
  CHECK_THAT(small_text(), !Contains(to_hex(test_key(5))));  // the secret is left out
}

TEST_CASE("evidence_record: a file name of any bytes is text that reads back") {
  EvidenceRecord record = small_evidence();
  record.images[0].name = "a\xff\"<b>\n.png";
  const auto s = parse_evidence(evidence_json(record, {}, {}), "evidence.json");
  CHECK(s.images[0].name == "a\xef\xbf\xbd\"<b>\n.png");
}

TEST_CASE("evidence_record: figures that do not follow from each other are refused") {
  const auto refused = [](const char* pointer, const Json& value, const char* what) {
    CHECK_THROWS_WITH(parse_evidence(changed(pointer, value), "evidence.json"),
                      Contains("evidence.json") && Contains(what));
  };
  refused("/found", false, "the decision does not follow");
  refused("/fpr", 1e-9, "the decision does not follow");
  refused("/together/p_value", 1e-9, "p_value does not follow");
  refused("/together/statistic", 2.0, "p_value does not follow");
  refused("/pictures/1/p_value_two_sided", 0.5, "p_value_two_sided does not follow");
  refused("/controls/0/together/p_value_bits", 1e-3, "p_value_bits does not follow");
  refused("/controls/1/pictures/0/p_value_bits_two_sided", 1e-3, "p_value_bits_two_sided does not follow");
  refused("/together/matching_bits", 3, "matching bits does not follow");
  refused("/together/bits", "10", "as many bits");
  refused("/format", "something", "expected the format");
  refused("/public_key", "12", "64 digits");
  refused("/message", "bb", "digits");
  refused("/message_bits", 4.5, "expected a whole number");
  refused("/message_bits", std::numeric_limits<std::int64_t>::max(), "expected a whole number");
  refused("/together/decided_bits", -1, "expected a whole number");
  refused("/pictures", 5, "expected evidence");
  refused("/files", "report.html", "expected evidence");
}

TEST_CASE("evidence_record: only the canonical form is read") {
  const std::string text = small_text();
  CHECK_THROWS_WITH(parse_evidence(text + " ", "evidence.json"), Contains("expected the canonical form"));
  CHECK_THROWS_AS(parse_evidence("", "evidence.json"), IoError);
  CHECK_THROWS_WITH(parse_evidence("[]\n", "evidence.json"), Contains("expected evidence"));
  std::string twice = text;  // a duplicate name is ambiguous
  twice.insert(twice.find("\"cells\""), "\"cells\": 11,\n  ");
  CHECK_THROWS_WITH(parse_evidence(twice, "evidence.json"), Contains("expected the canonical form"));
}
