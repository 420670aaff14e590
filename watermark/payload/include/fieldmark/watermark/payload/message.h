#pragma once
#include <fieldmark/engine/random.h>
#include <fieldmark/engine/shape.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// The bits that a mark carries, each 0 or 1.
struct Message {
  std::vector<std::uint8_t> bits;  ///< [n]
  /// Number of bits.
  Index size() const { return static_cast<Index>(bits.size()); }
  /// Equal in length and every bit.
  friend bool operator==(const Message&, const Message&) = default;
};

/// Parses a message from hexadecimal digits of either case, most significant bit first: "a0" is 1010 0000.
/// @param hex     ceil(n_bits / 4) digits without a prefix; bits of the last digit beyond n_bits must be 0
/// @param n_bits  at least 1
/// @throws ValueError for another character, another number of digits, or unused bits that are set
Message message_from_hex(std::string_view hex, Index n_bits);

/// Returns ceil(size / 4) lower-case digits, most significant bit first; unused bits of the last digit are 0.
/// @throws ValueError if a bit is neither 0 nor 1
std::string to_hex(const Message& message);

/// Returns a string of '0' and '1', first bit first.   @throws ValueError if a bit is neither 0 nor 1
std::string to_bits(const Message& message);

/// Draws fair, independent bits for training and measuring; not secret. Bit i is bit (i mod 32) of the
/// generator's word (i div 32) at (index, ..).   @param n_bits  at least 1   @throws ValueError otherwise
Message random_message(Index n_bits, const CounterRng& rng, std::uint64_t index);

}  // namespace fieldmark::watermark
