#pragma once
#include <fieldmark/engine/shape.h>
#include <fieldmark/watermark/keys/key.h>

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace fieldmark::watermark {

/// Word `index` of the pseudo-random stream of a key and a domain.
///   word(i) = little-endian 64-bit word (i mod 8) of BLAKE2b-512_key(le64(|domain|) || domain || le64(i div
///   8))
/// Source: Aumasson et al. 2013 (BLAKE2); keyed BLAKE2b is a pseudo-random function.
/// @param domain  what the numbers are for; streams of two domains are independent
std::uint64_t keyed_u64(const Key& key, std::string_view domain, std::uint64_t index);

/// Words 0 to out.size() - 1 of the stream, eight for each hash.
void keyed_words(const Key& key, std::string_view domain, std::span<std::uint64_t> out);

/// +1 or -1 from bit (index mod 64) of word (index div 64) of the stream: a set bit is +1.
int keyed_sign(const Key& key, std::string_view domain, std::uint64_t index);

/// Signs 0 to out.size() - 1, each +1 or -1.
void keyed_signs(const Key& key, std::string_view domain, std::span<std::int8_t> out);

/// Pseudo-random permutation of 0 .. n - 1: indices sorted by their words, ties by index.
/// @throws ValueError if n < 0
std::vector<Index> keyed_order(const Key& key, std::string_view domain, Index n);

/// Another key from this one: the first 32 bytes of BLAKE2b-256_key(le64(|domain|) || domain || le64(index)).
/// A derived key is as secret as the key it comes from, and no more.
Key derive_key(const Key& key, std::string_view domain, std::uint64_t index);

}  // namespace fieldmark::watermark
