#include <fieldmark/core/error.h>
#include <fieldmark/watermark/payload/payload.h>

#include <cmath>

#include "support/catch.h"
#include "watermark/bits_of.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {

constexpr const char* kUuid = "01234567-89ab-cdef-0123-456789abcdef";

}  // namespace

TEST_CASE("payload: values go to bits and back") {
  const Payload number = parse_payload(PayloadKind::hex, "C0fFee");
  CHECK(number.value == "c0ffee");
  CHECK(payload_bits(number) == 24);
  CHECK(payload_data(number, 24) == bits_of(0xc0ffee, 24));
  CHECK(payload_from_data(PayloadKind::hex, payload_data(number, 32))->value == "00c0ffee");
  for (const char* text :
       {"a", "hello", "\xc3\xa9t\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x8c\x8d", "0123456789abcdef"}) {
    const Payload p = parse_payload(PayloadKind::text, text);
    CHECK(payload_bits(p) == 8 * static_cast<Index>(p.value.size()));
    CHECK(payload_from_data(PayloadKind::text, payload_data(p, 128)) == p);
  }
  CHECK(payload_data(parse_payload(PayloadKind::text, "A"), 16) == bits_of(0x4100, 16));
  const Payload uuid = parse_payload(PayloadKind::uuid, "0123456789ABCDEF0123456789abcdef");
  CHECK(uuid.value == kUuid);
  CHECK(parse_payload(PayloadKind::uuid, kUuid) == uuid);
  CHECK(payload_bits(uuid) == 128);
  CHECK(payload_from_data(PayloadKind::uuid, payload_data(uuid, 128)) == uuid);
  CHECK_FALSE(payload_from_data(PayloadKind::uuid, bits_of(0, 64)));
  CHECK(std::string(payload_kind_name(PayloadKind::hex)) == "hex");
  CHECK(std::string(payload_kind_name(PayloadKind::text)) == "text");
  CHECK(std::string(payload_kind_name(PayloadKind::uuid)) == "uuid");
}

TEST_CASE("payload: what is no value is refused with its place") {
  const auto text = [](std::string_view value) { return parse_payload(PayloadKind::text, value); };
  CHECK_THROWS_WITH(text(""), "[parse_payload] text: must have 1 to 16 bytes of UTF-8, got 0");
  CHECK_THROWS_WITH(text("seventeen bytes.."),
                    "[parse_payload] text: must have 1 to 16 bytes of UTF-8, got 17");
  CHECK_THROWS_WITH(
      text("ab\xff"),
      "[parse_payload] text: byte 3 must begin a character of UTF-8 that is no control character, got 255");
  for (const char* wrong : {"\n",
                            "a\x1b[2J",
                            "\x7f",
                            "\xc2\x80",
                            "\xc2\x9b",
                            "\xc0\xaf",
                            "\xc1\x81",
                            "\xe0\x9f\xbf",
                            "\xed\xa0\x80",
                            "\xed\xbf\xbf",
                            "\xf0\x8f\xbf\xbf",
                            "\xf4\x90\x80\x80",
                            "\xf5\x80\x80\x80",
                            "\xe2\x82",
                            "\xf0\x9f\x8c",
                            "\x80",
                            "\xc3(",
                            "\xe2\x28\xa1",
                            "\xfe",
                            "\xf8\x88\x80\x80\x80"})
    CHECK_THROWS_AS(text(wrong), ValueError);
  CHECK_THROWS_AS(text(std::string_view("a\0b", 3)), ValueError);
  for (const char* right : {"\xc2\xa0", "\xdf\xbf", "\xe0\xa0\x80", "\xed\x9f\xbf", "\xee\x80\x80",
                            "\xf0\x90\x80\x80", "\xf4\x8f\xbf\xbf"})
    CHECK(text(right).value == right);
  CHECK_THROWS_WITH(parse_payload(PayloadKind::hex, ""),
                    "[parse_payload] hex: must have 1 to 32 digits, got 0");
  CHECK_THROWS_AS(parse_payload(PayloadKind::hex, std::string(33, '1')), ValueError);
  CHECK_THROWS_AS(parse_payload(PayloadKind::hex, "0x12"), ValueError);
  CHECK_THROWS_WITH(
      parse_payload(PayloadKind::uuid, "0123"),
      "[parse_payload] uuid: must have 32 digits, with hyphens as in 8-4-4-4-12 or with none, got 4 "
      "characters");
  CHECK_THROWS_WITH(parse_payload(PayloadKind::uuid, "0123456-789ab-cdef-0123-456789abcdef"),
                    "[parse_payload] uuid: character 9 must be a hyphen");
  CHECK_THROWS_AS(parse_payload(PayloadKind::uuid, "0123456--89ab-cdef-0123-456789abcdef"), ValueError);
  CHECK_THROWS_AS(parse_payload(PayloadKind::uuid, "g1234567-89ab-cdef-0123-456789abcdef"), ValueError);
  CHECK_THROWS_WITH(payload_data(parse_payload(PayloadKind::text, "abc"), 16),
                    "[payload_data] data: must be at least 24 bits, got 16");
  CHECK_THROWS_WITH(payload_data(parse_payload(PayloadKind::hex, "1"), 12),
                    "[payload_data] data: must be a multiple of 8 bits, got 12");
  CHECK_THROWS_AS(payload_from_data(PayloadKind::hex, bits_of(0, 9)), ValueError);
}

TEST_CASE("payload: the number of payloads is that of the words that are taken, all words tried") {
  for (int bits : {8, 16}) {
    double texts = 0;
    for (std::uint64_t word = 0; word < 1u << bits; ++word) {
      const auto found = payload_from_data(PayloadKind::text, bits_of(word, bits));
      if (!found) continue;
      texts += 1;
      CHECK(parse_payload(PayloadKind::text, found->value) == *found);
      CHECK(payload_data(*found, bits) == bits_of(word, bits));
    }
    CHECK(payload_count(PayloadKind::text, bits) == texts);
  }
  // Words that begin like a three-byte character; the other cases follow from those above.
  Index texts = 0;
  for (std::uint64_t word = 0xe00000; word < 0xf00000; ++word)
    texts += payload_from_data(PayloadKind::text, bits_of(word, 24)).has_value();
  CHECK(texts == 61440);
  CHECK(payload_count(PayloadKind::text, 24) ==
        95 * (1 + payload_count(PayloadKind::text, 16)) + 1888 * (1 + 95) + 61440);
  CHECK(payload_count(PayloadKind::hex, 40) == std::ldexp(1.0, 40));
  CHECK(payload_count(PayloadKind::uuid, 128) == std::ldexp(1.0, 128));
  CHECK(payload_count(PayloadKind::uuid, 64) == 0);
}
