#pragma once
#include <fieldmark/watermark/keys/key.h>

#include <cstdint>
#include <span>
#include <string_view>

namespace fieldmark::watermark {

/// Writes words 0 to out.size() - 1 of the pseudo-random stream of a key and a domain.
///   word(i) = little-endian 64-bit word (i mod 8) of
///             BLAKE2b-512_key(le64(|domain|) || domain || le64(i div 8))
/// Source: Aumasson et al. 2013 (BLAKE2); keyed BLAKE2b is a pseudo-random function.
/// @param domain  purpose of the stream; streams of two domains are independent
void keyed_words(const Key& key, std::string_view domain, std::span<std::uint64_t> out);

/// Writes signs 0 to out.size() - 1: +1 where bit (i mod 64) of word (i div 64) of the stream is set,
/// else -1.
void keyed_signs(const Key& key, std::string_view domain, std::span<std::int8_t> out);

/// Derives another key: the first 32 bytes of BLAKE2b-256_key(le64(|domain|) || domain || le64(index)).
/// Whoever holds the key can derive it; nobody can invert the derivation.
Key derive_key(const Key& key, std::string_view domain, std::uint64_t index);

/// Makes a key for simulations: the little-endian bytes of the seed, then zeros. Not a secret: whoever knows
/// the seed knows the key.
Key key_of_seed(std::uint64_t seed);

}  // namespace fieldmark::watermark
