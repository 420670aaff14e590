#include <fieldmark/core/error.h>
#include <fieldmark/watermark/payload/message.h>
#include <fieldmark/watermark/payload/payload.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr Index kByteBits = 8, kUuidBits = 128, kMostBytes = 16;
constexpr std::size_t kHyphens[] = {8, 13, 18, 23}, kHyphenatedUuid = 36, kUuidDigits = 32;

// Returns the number of bytes of the character that begins at text[i]; 0 if no character allowed in a payload
// begins there. Source: RFC 3629, section 4 (no surrogates, no overlong forms), without control characters.
std::size_t character_bytes(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned first = byte(i);
  if (first < 0x80) return first >= 0x20 && first != 0x7f ? 1 : 0;
  const std::size_t size = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || i + size > text.size()) return 0;
  unsigned code = first & (0xffu >> (size + 1));
  for (std::size_t k = i + 1; k < i + size; ++k) {
    if ((byte(k) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(k) & 0x3fu);
  }
  const bool control = code < 0xa0, surrogate = code >= 0xd800 && code <= 0xdfff;
  const unsigned least = size == 4 ? 0x10000 : size == 3 ? 0x800 : 0x80;
  return control || surrogate || code < least || code > 0x10ffff ? 0 : size;
}

// Returns the index of the first byte that is not part of a character; the size of the text if all are.
std::size_t first_wrong(std::string_view text) {
  std::size_t i = 0;
  while (i < text.size()) {
    const std::size_t size = character_bytes(text, i);
    if (size == 0) break;
    i += size;
  }
  return i;
}

std::string lower_digits(std::string_view digits) {
  const auto bits = message_from_hex(digits, 4 * static_cast<Index>(digits.size()));
  return to_hex(bits);
}

Payload parse_hex(std::string_view value) {
  if (value.empty() || value.size() > kUuidDigits)
    throw ValueError("[parse_payload] hex: must have 1 to 32 digits, got " + std::to_string(value.size()));
  return {PayloadKind::hex, lower_digits(value)};
}

Payload parse_text(std::string_view value) {
  if (value.empty() || value.size() > static_cast<std::size_t>(kMostBytes))
    throw ValueError("[parse_payload] text: must have 1 to 16 bytes of UTF-8, got " +
                     std::to_string(value.size()));
  if (const std::size_t i = first_wrong(value); i < value.size())
    throw ValueError("[parse_payload] text: byte " + std::to_string(i + 1) +
                     " must begin a character of UTF-8 that is no control character, got " +
                     std::to_string(static_cast<unsigned char>(value[i])));
  return {PayloadKind::text, std::string(value)};
}

std::string with_hyphens(std::string digits) {
  for (std::size_t at : kHyphens) digits.insert(at, 1, '-');
  return digits;
}

Payload parse_uuid(std::string_view value) {
  std::string digits(value);
  if (digits.size() == kHyphenatedUuid) {
    for (std::size_t at : kHyphens)
      if (value[at] != '-')
        throw ValueError("[parse_payload] uuid: character " + std::to_string(at + 1) + " must be a hyphen");
    std::erase(digits, '-');
  }
  if (digits.size() != kUuidDigits)
    throw ValueError(
        "[parse_payload] uuid: must have 32 digits, with hyphens as in 8-4-4-4-12 or with none, got " +
        std::to_string(value.size()) + " characters");
  return {PayloadKind::uuid, with_hyphens(lower_digits(digits))};
}

void check_bytes(const char* op, Index bits) {
  if (bits < kByteBits || bits % kByteBits != 0)
    throw ValueError("[" + std::string(op) + "] data: must be a multiple of 8 bits, got " +
                     std::to_string(bits));
}

std::optional<Payload> text_of(std::span<const std::uint8_t> data) {
  std::string text;
  for (std::size_t i = 0; i < data.size(); i += 8) {
    unsigned byte = 0;
    for (std::size_t k = 0; k < 8; ++k) byte = 2 * byte + data[i + k];
    text += static_cast<char>(byte);
  }
  text.resize(text.find_last_not_of('\0') + 1);
  if (text.empty() || first_wrong(text) < text.size()) return std::nullopt;
  return Payload{PayloadKind::text, text};
}

}  // namespace

const char* payload_kind_name(PayloadKind kind) {
  return kind == PayloadKind::hex ? "hex" : kind == PayloadKind::text ? "text" : "uuid";
}

Payload parse_payload(PayloadKind kind, std::string_view value) {
  return kind == PayloadKind::hex    ? parse_hex(value)
         : kind == PayloadKind::text ? parse_text(value)
                                     : parse_uuid(value);
}

Index payload_bits(const Payload& payload) {
  const auto size = static_cast<Index>(payload.value.size());
  return payload.kind == PayloadKind::hex    ? 4 * size
         : payload.kind == PayloadKind::text ? kByteBits * size
                                             : kUuidBits;
}

std::vector<std::uint8_t> payload_data(const Payload& payload, Index data_bits) {
  check_bytes("payload_data", data_bits);
  const Index bits = payload_bits(payload);
  if (bits > data_bits)
    throw ValueError("[payload_data] data: must be at least " + std::to_string(bits) + " bits, got " +
                     std::to_string(data_bits));
  std::string digits = payload.value;
  if (payload.kind == PayloadKind::text) {
    digits.clear();
    for (char c : payload.value) {
      digits += "0123456789abcdef"[static_cast<unsigned char>(c) >> 4];
      digits += "0123456789abcdef"[static_cast<unsigned char>(c) & 15];
    }
  }
  std::erase(digits, '-');
  const std::string zeros(static_cast<std::size_t>(data_bits / 4) - digits.size(), '0');
  return message_from_hex(payload.kind == PayloadKind::text ? digits + zeros : zeros + digits, data_bits)
      .bits;
}

std::optional<Payload> payload_from_data(PayloadKind kind, std::span<const std::uint8_t> data) {
  check_bytes("payload_from_data", static_cast<Index>(data.size()));
  if (kind == PayloadKind::text) return text_of(data);
  std::string digits = to_hex(Message{{data.begin(), data.end()}});
  if (kind == PayloadKind::hex) return Payload{kind, digits};
  if (static_cast<Index>(data.size()) != kUuidBits) return std::nullopt;
  return Payload{kind, with_hyphens(digits)};
}

double payload_count(PayloadKind kind, Index data_bits) {
  check_bytes("payload_count", data_bits);
  if (kind == PayloadKind::uuid) return data_bits == kUuidBits ? std::ldexp(1.0, kUuidBits) : 0.0;
  if (kind == PayloadKind::hex) return std::ldexp(1.0, static_cast<int>(data_bits));
  // Counts characters by their bytes: ASCII without 33 control characters; to U+07FF without 32; to U+FFFF
  // without surrogates; the rest.
  constexpr double kCharacters[] = {95, 1888, 61440, 1048576};
  std::vector<double> texts{1};  // texts[i]: number of texts of i bytes
  double sum = 0;
  for (std::size_t bytes = 1; bytes <= static_cast<std::size_t>(data_bits / kByteBits); ++bytes) {
    texts.push_back(0);
    for (std::size_t size = 1; size <= std::min<std::size_t>(bytes, 4); ++size)
      texts[bytes] += kCharacters[size - 1] * texts[bytes - size];
    sum += texts[bytes];
  }
  return sum;
}

}  // namespace fieldmark::watermark
