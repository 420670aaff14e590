#pragma once
#include <fieldmark/engine/shape.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// Types of payload.
enum class PayloadKind {
  hex,   ///< a number, in hexadecimal digits
  text,  ///< UTF-8 without control characters
  uuid   ///< 128 bits, written 8-4-4-4-12
};
/// Returns "hex", "text" or "uuid".
const char* payload_kind_name(PayloadKind kind);

/// An owner's data, carried by a mark.
struct Payload {
  PayloadKind kind = PayloadKind::hex;  ///< type of the value
  std::string value{};                  ///< hex and uuid: lower-case digits, a uuid with its hyphens
  /// Equal in kind and value.
  friend bool operator==(const Payload&, const Payload&) = default;
};

/// Checks a value and normalises it.
/// @param value  hex: 1 to 32 digits of either case; text: 1 to 16 bytes of UTF-8; uuid: 32 digits, the
/// hyphens all or none   @throws ValueError that names the place of the fault
Payload parse_payload(PayloadKind kind, std::string_view value);

/// Returns the size of a payload in bits: 4 per digit, 8 per byte, 128 for a uuid.
Index payload_bits(const Payload& payload);

/// Encodes a payload as `data_bits` bits, most significant first: hex padded with leading zeros, text with
/// trailing zero bytes.
/// @param data_bits  a multiple of 8, at least payload_bits()   @throws ValueError otherwise
std::vector<std::uint8_t> payload_data(const Payload& payload, Index data_bits);

/// Decodes the bits of payload_data(); hex keeps its leading zeros.
/// @param data  a multiple of 8 bits   @return nothing for invalid data: text that is empty, not UTF-8 or
/// holds control characters, or a uuid whose length is not 128   @throws ValueError for another number of
/// bits
std::optional<Payload> payload_from_data(PayloadKind kind, std::span<const std::uint8_t> data);

/// Returns how many of the 2^data_bits words payload_from_data() accepts, rounded to a double.
double payload_count(PayloadKind kind, Index data_bits);

}  // namespace fieldmark::watermark
