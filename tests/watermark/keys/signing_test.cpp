#include <fieldmark/core/error.h>
#include <fieldmark/watermark/keys/signing.h>

#include <algorithm>

#include "support/catch.h"
#include "watermark/test_key.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
Signature signature_from_hex(const std::string& hex) {
  Signature signature;
  for (std::size_t i = 0; i < signature.bytes.size(); ++i)
    signature.bytes[i] = static_cast<std::uint8_t>(std::stoi(hex.substr(2 * i, 2), nullptr, 16));
  return signature;
}
}  // namespace

TEST_CASE("signing: the standard's first example is accepted (RFC 8032, section 7.1)") {
  const auto key = public_key_from_hex("d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a");
  const auto signature = signature_from_hex(
      "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46bd25bf5"
      "f0"
      "595bbe24655141438e7a100b");
  CHECK(is_signed("", signature, key));
  CHECK_FALSE(is_signed("a", signature, key));
}

TEST_CASE("signing: the pair of a key is what Python's BLAKE2b and OpenSSL make of it") {
  const Key key = test_key(0);
  CHECK(to_hex(public_key(key)) == "d5ec59471d2bb1500bb1c2cf2797592917bd06a6de6ba176845db5fea99c202c");
  const auto expected = signature_from_hex(
      "58444eca85739aea63696dd86285fae34bc8d57b82642a0c0c480f8f59a9997b929e6ecc25db49f6fa83b75d42c97befc982d7"
      "d4"
      "51c0214dd009977e51762205");
  CHECK(sign(key, "{\"found\":true}\n").bytes == expected.bytes);
}

TEST_CASE("signing: another text, signature or key is noticed") {
  const Key key = test_key(3);
  const std::string text = "what was found";
  const Signature signature = sign(key, text);
  const PublicKey open = public_key(key);
  CHECK(is_signed(text, signature, open));
  CHECK_FALSE(is_signed(text, signature, public_key(test_key(4))));
  for (std::size_t i = 0; i < text.size(); ++i) {
    std::string other = text;
    other[i] ^= 1;
    CHECK_FALSE(is_signed(other, signature, open));
  }
  for (std::size_t i = 0; i < signature.bytes.size(); ++i) {
    Signature other = signature;
    other.bytes[i] ^= 0x10;
    CHECK_FALSE(is_signed(text, other, open));
  }
  CHECK_FALSE(is_signed(text + " ", signature, open));
}

TEST_CASE(
    "signing: a public key as text, and as the file of the standard's example (RFC 8410, section 10.1)") {
  const std::string hex = "19bf44096984cdfe8541bac167dc3b96c85086aa30b6b6cb0c5c38ad703166e1";
  const PublicKey key = public_key_from_hex(hex);
  CHECK(to_hex(key) == hex);
  CHECK(to_pem(key) ==
        "-----BEGIN PUBLIC KEY-----\n"
        "MCowBQYDK2VwAyEAGb9ECWmEzf6FQbrBZ9w7lshQhqowtrbLDFw4rXAxZuE=\n"
        "-----END PUBLIC KEY-----\n");
  CHECK_THROWS_AS(public_key_from_hex(hex.substr(1)), ValueError);
  CHECK_THROWS_WITH(public_key_from_hex("xy"),
                    "[public_key_from_hex] hex must be 64 digits 0-9 or a-f, got 'xy'");
}
