#pragma once
#include <fieldmark/engine/shape.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// What a message can stand for.
enum class PayloadKind {
  hex,   ///< a number, in hexadecimal digits
  text,  ///< UTF-8 without control characters
  uuid   ///< 128 bits, written 8-4-4-4-12
};
/// "hex", "text" or "uuid".
const char* payload_kind_name(PayloadKind kind);

/// What an owner wants to have said by a mark.
struct Payload {
  PayloadKind kind = PayloadKind::hex;  ///< how value is to be taken
  std::string value{};                  ///< digits of hex and uuid in lower case, a uuid with its hyphens
  /// Equal in kind and value.
  friend bool operator==(const Payload&, const Payload&) = default;
};

/// Checks a value and brings it to the form that Payload has.
/// @param value  hex: 1 to 32 digits of either case; text: 1 to 16 bytes of UTF-8; uuid: 32 digits, the
/// hyphens all or none   @throws ValueError naming the place of what is wrong
Payload parse_payload(PayloadKind kind, std::string_view value);

/// Bits that a payload takes: 4 a digit, 8 a byte, 128.
Index payload_bits(const Payload& payload);

/// A payload as `data_bits` bits, most significant first: hex with zeros before it, text with zero bytes
/// behind it.
/// @param data_bits  a multiple of 8, at least payload_bits()   @throws ValueError otherwise
std::vector<std::uint8_t> payload_data(const Payload& payload, Index data_bits);

/// The payload that these bits are; hex comes with all its zeros.
/// @param data  a multiple of 8 bits   @return nothing if no payload of this kind has this data: text that is
/// empty, has control characters or zeros in it, or is no UTF-8, and a uuid of another length than 128
/// @throws ValueError if the number of bits is no multiple of 8
std::optional<Payload> payload_from_data(PayloadKind kind, std::span<const std::uint8_t> data);

/// How many of the 2^data_bits words payload_from_data() takes, exact to a double's rounding.
double payload_count(PayloadKind kind, Index data_bits);

}  // namespace fieldmark::watermark
