#include <fieldmark/core/error.h>
#include <fieldmark/watermark/payload/message.h>

#include <cmath>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("message: hexadecimal, most significant bit first") {
  CHECK(to_bits(message_from_hex("a0", 8)) == "10100000");
  CHECK(to_bits(message_from_hex("DeadBeef", 32)) == "11011110101011011011111011101111");
  CHECK(to_bits(message_from_hex("a8", 5)) == "10101");
  CHECK(to_bits(message_from_hex("8", 1)) == "1");
  CHECK(to_hex(Message{{1, 0, 1, 0, 1}}) == "a8");
  CHECK(to_hex(Message{}) == "");
  CHECK(to_bits(Message{}) == "");
  for (Index n = 1; n <= 130; ++n) {
    const Message message = random_message(n, CounterRng(1), static_cast<std::uint64_t>(n));
    CHECK(message_from_hex(to_hex(message), n) == message);
  }
}

TEST_CASE("message: what is wrong with the digits is named") {
  CHECK_THROWS_AS(message_from_hex("12", 16), ValueError);
  CHECK_THROWS_WITH(message_from_hex("12x4", 16),
                    "[message_from_hex] hex: character 3 must be a digit 0-9 or a-f, got 'x'");
  CHECK_THROWS_WITH(message_from_hex("12\n", 16),
                    "[message_from_hex] hex: character 3 must be a digit 0-9 or a-f, got byte 10");
  CHECK_THROWS_WITH(message_from_hex("12", 16),
                    "[message_from_hex] hex: must have 4 digits (a message of 16 bits), got 2");
  CHECK_THROWS_WITH(message_from_hex("12345", 16),
                    "[message_from_hex] hex: must have 4 digits (a message of 16 bits), got 5");
  CHECK_THROWS_WITH(
      message_from_hex("a4", 5),
      "[message_from_hex] hex: the last 3 bits of the last digit must be 0 (a message of 5 bits), got '4'");
  CHECK_THROWS_WITH(message_from_hex("", 0), "[message_from_hex] n_bits must be at least 1, got 0");
  CHECK_THROWS_WITH(to_hex(Message{{0, 2}}), "[to_hex] message: bit 1 must be 0 or 1, got 2");
  CHECK_THROWS_WITH(to_bits(Message{{3}}), "[to_bits] message: bit 0 must be 0 or 1, got 3");
}

TEST_CASE("message: random messages repeat, differ by index and are fair in every bit") {
  CHECK(random_message(48, CounterRng(7), 3) == random_message(48, CounterRng(7), 3));
  CHECK_FALSE(random_message(48, CounterRng(7), 3) == random_message(48, CounterRng(7), 4));
  CHECK_THROWS_WITH(random_message(0, CounterRng(7), 0), "[random_message] n_bits must be at least 1, got 0");
  std::vector<int> ones(300);
  for (std::uint64_t index = 0; index < 1000; ++index) {
    const Message message = random_message(300, CounterRng(7), index);
    for (std::size_t i = 0; i < ones.size(); ++i) ones[i] += message.bits[i];
  }
  for (int count : ones) CHECK(std::abs(count - 500) < 5 * 16);  // sqrt(1000) / 2 = 15.8
}
