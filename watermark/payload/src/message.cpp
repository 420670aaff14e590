#include <fieldmark/core/error.h>
#include <fieldmark/watermark/payload/message.h>

namespace fieldmark::watermark {
namespace {
constexpr Index kDigitBits = 4;

int digit_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

// Returns a character in printable form: it may be a control character or a byte of a longer UTF-8 sequence.
std::string quoted(char c) {
  const auto byte = static_cast<unsigned char>(c);
  if (byte >= 0x20 && byte < 0x7f) return std::string("'") + c + "'";
  return "byte " + std::to_string(byte);
}

void check_bits(std::string_view op, const Message& message) {
  for (std::size_t i = 0; i < message.bits.size(); ++i) {
    if (message.bits[i] <= 1) continue;
    throw ValueError("[" + std::string(op) + "] message: bit " + std::to_string(i) + " must be 0 or 1, got " +
                     std::to_string(message.bits[i]));
  }
}
}  // namespace

Message message_from_hex(std::string_view hex, Index n_bits) {
  const std::string head = "[message_from_hex] ";
  if (n_bits < 1) throw ValueError(head + "n_bits must be at least 1, got " + std::to_string(n_bits));
  for (std::size_t i = 0; i < hex.size(); ++i) {
    if (digit_value(hex[i]) >= 0) continue;
    throw ValueError(head + "hex: character " + std::to_string(i + 1) + " must be a digit 0-9 or a-f, got " +
                     quoted(hex[i]));
  }
  const Index digits = (n_bits + kDigitBits - 1) / kDigitBits;
  if (static_cast<Index>(hex.size()) != digits) {
    throw ValueError(head + "hex: must have " + std::to_string(digits) + " digits (a message of " +
                     std::to_string(n_bits) + " bits), got " + std::to_string(hex.size()));
  }
  Message message;
  for (char c : hex) {
    for (Index k = kDigitBits - 1; k >= 0; --k) {
      message.bits.push_back(static_cast<std::uint8_t>((digit_value(c) >> k) & 1));
    }
  }
  for (std::size_t i = static_cast<std::size_t>(n_bits); i < message.bits.size(); ++i) {
    if (message.bits[i] == 0) continue;
    throw ValueError(head + "hex: the last " + std::to_string(digits * kDigitBits - n_bits) +
                     " bits of the last digit must be 0 (a message of " + std::to_string(n_bits) +
                     " bits), got '" + std::string(1, hex.back()) + "'");
  }
  message.bits.resize(static_cast<std::size_t>(n_bits));
  return message;
}

std::string to_hex(const Message& message) {
  check_bits("to_hex", message);
  std::string hex;
  for (Index begin = 0; begin < message.size(); begin += kDigitBits) {
    unsigned value = 0;
    for (Index i = begin; i < begin + kDigitBits; ++i) {
      value = 2 * value + (i < message.size() ? message.bits[static_cast<std::size_t>(i)] : 0u);
    }
    hex += "0123456789abcdef"[value];
  }
  return hex;
}

std::string to_bits(const Message& message) {
  check_bits("to_bits", message);
  std::string text;
  for (std::uint8_t bit : message.bits) text += bit ? '1' : '0';
  return text;
}

Message random_message(Index n_bits, const CounterRng& rng, std::uint64_t index) {
  if (n_bits < 1)
    throw ValueError("[random_message] n_bits must be at least 1, got " + std::to_string(n_bits));
  Message message;
  message.bits.resize(static_cast<std::size_t>(n_bits));
  constexpr std::size_t kBlockBits = 128;
  for (std::size_t i = 0; i < message.bits.size(); ++i) {
    const auto words = rng.bits(index, i / kBlockBits);
    message.bits[i] = static_cast<std::uint8_t>((words[i % kBlockBits / 32] >> (i % 32)) & 1u);
  }
  return message;
}

}  // namespace fieldmark::watermark
