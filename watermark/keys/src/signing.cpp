#include <fieldmark/core/base64.h>
#include <fieldmark/core/error.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/keys/signing.h>

#include <algorithm>

#include <fieldmark/core/sodium.h>

namespace fieldmark::watermark {
namespace {

static_assert(sizeof(PublicKey::bytes) == crypto_sign_PUBLICKEYBYTES);
static_assert(sizeof(Signature::bytes) == crypto_sign_BYTES);
static_assert(sizeof(Key::bytes) == crypto_sign_SEEDBYTES);

struct Pair {
  PublicKey open;
  std::array<unsigned char, crypto_sign_SECRETKEYBYTES> secret{};
  explicit Pair(const Key& key) {
    ensure_sodium();
    const Key seed = derive_key(key, "fieldmark evidence signature", 0);
    crypto_sign_seed_keypair(open.bytes.data(), secret.data(), seed.bytes.data());
  }
};

const unsigned char* bytes_of(std::string_view text) {
  return reinterpret_cast<const unsigned char*>(text.data());
}

// Prefix of the 32 bytes in RFC 8410: SEQUENCE { SEQUENCE { OID 1.3.101.112 }, BIT STRING }.
constexpr std::array<std::uint8_t, 12> kDerHead{0x30, 0x2a, 0x30, 0x05, 0x06, 0x03,
                                                0x2b, 0x65, 0x70, 0x03, 0x21, 0x00};
}  // namespace

PublicKey public_key(const Key& key) { return Pair(key).open; }

Signature sign(const Key& key, std::string_view bytes) {
  const Pair pair(key);
  Signature signature;
  crypto_sign_detached(signature.bytes.data(), nullptr, bytes_of(bytes), bytes.size(), pair.secret.data());
  return signature;
}

bool is_signed(std::string_view bytes, const Signature& signature, const PublicKey& key) {
  ensure_sodium();
  return crypto_sign_verify_detached(signature.bytes.data(), bytes_of(bytes), bytes.size(),
                                     key.bytes.data()) == 0;
}

std::string to_hex(const PublicKey& key) {
  std::string text(2 * key.bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), key.bytes.data(), key.bytes.size());
  text.pop_back();
  return text;
}

PublicKey public_key_from_hex(std::string_view hex) {
  const bool digits = std::all_of(hex.begin(), hex.end(),
                                  [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
  PublicKey key;
  if (hex.size() != 2 * key.bytes.size() || !digits)
    throw ValueError("[public_key_from_hex] hex must be 64 digits 0-9 or a-f, got '" + std::string(hex) +
                     "'");
  sodium_hex2bin(key.bytes.data(), key.bytes.size(), hex.data(), hex.size(), nullptr, nullptr, nullptr);
  return key;
}

std::string to_pem(const PublicKey& key) {
  std::array<std::uint8_t, kDerHead.size() + sizeof(key.bytes)> der;
  std::copy(key.bytes.begin(), key.bytes.end(), std::copy(kDerHead.begin(), kDerHead.end(), der.begin()));
  return "-----BEGIN PUBLIC KEY-----\n" + to_base64(std::as_bytes(std::span(der))) +
         "\n-----END PUBLIC KEY-----\n";
}

}  // namespace fieldmark::watermark
