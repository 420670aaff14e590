#pragma once
#include <fieldmark/watermark/keys/key.h>

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// The public half of an Ed25519 key pair: it verifies signatures.
struct PublicKey {
  std::array<std::uint8_t, 32> bytes{};  ///< RFC 8032, section 5.1.5
  /// Equal in every byte.
  friend bool operator==(const PublicKey&, const PublicKey&) = default;
};

/// An Ed25519 signature.
struct Signature {
  std::array<std::uint8_t, 64> bytes{};  ///< RFC 8032, section 5.1.6
};

/// Returns the public half of the pair that a key signs with. The pair's seed is derive_key(key, "fieldmark
/// evidence signature", 0), so the owner keeps one secret only, and signatures reveal nothing of it.
PublicKey public_key(const Key& key);

/// Signs bytes with the pair of a key. Deterministic.
Signature sign(const Key& key, std::string_view bytes);

/// True if the holder of a public key signed exactly these bytes.
bool is_signed(std::string_view bytes, const Signature& signature, const PublicKey& key);

/// Returns 64 lower-case hexadecimal digits.
std::string to_hex(const PublicKey& key);

/// Parses a public key.   @param hex  64 digits 0-9 or a-f   @throws ValueError otherwise
PublicKey public_key_from_hex(std::string_view hex);

/// Returns the key as PEM text (SubjectPublicKeyInfo, RFC 8410), for OpenSSL and other tools.
std::string to_pem(const PublicKey& key);

}  // namespace fieldmark::watermark
