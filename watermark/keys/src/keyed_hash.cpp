#include <fieldmark/core/error.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <fieldmark/core/sodium.h>

namespace fieldmark::watermark {
namespace {
constexpr std::size_t kWordsPerBlock = 8;
constexpr std::size_t kWordBytes = 8;

void put_le64(std::uint64_t value, unsigned char* out) {
  for (std::size_t k = 0; k < kWordBytes; ++k) out[k] = static_cast<unsigned char>(value >> (8 * k));
}

std::uint64_t get_le64(const unsigned char* in) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < kWordBytes; ++k) value |= static_cast<std::uint64_t>(in[k]) << (8 * k);
  return value;
}

// The message that is hashed; only its counter changes from block to block. The length in front keeps the
// stream of one domain apart from that of every other.
class HashInput {
 public:
  explicit HashInput(std::string_view domain) : bytes_(domain.size() + 2 * kWordBytes, '\0') {
    put_le64(domain.size(), data());
    std::copy(domain.begin(), domain.end(), bytes_.begin() + kWordBytes);
  }
  template <std::size_t N>
  void hash(const Key& key, std::uint64_t counter, std::array<unsigned char, N>& out) {
    put_le64(counter, data() + bytes_.size() - kWordBytes);
    crypto_generichash(out.data(), N, data(), bytes_.size(), key.bytes.data(), key.bytes.size());
  }

 private:
  unsigned char* data() { return reinterpret_cast<unsigned char*>(bytes_.data()); }
  std::string bytes_;
};

using Block = std::array<unsigned char, kWordsPerBlock * kWordBytes>;
}  // namespace

std::uint64_t keyed_u64(const Key& key, std::string_view domain, std::uint64_t index) {
  ensure_sodium();
  Block block;
  HashInput(domain).hash(key, index / kWordsPerBlock, block);
  return get_le64(block.data() + kWordBytes * (index % kWordsPerBlock));
}

void keyed_words(const Key& key, std::string_view domain, std::span<std::uint64_t> out) {
  ensure_sodium();
  HashInput input(domain);
  Block block;
  for (std::size_t begin = 0; begin < out.size(); begin += kWordsPerBlock) {
    input.hash(key, begin / kWordsPerBlock, block);
    const std::size_t count = std::min(kWordsPerBlock, out.size() - begin);
    for (std::size_t k = 0; k < count; ++k) out[begin + k] = get_le64(block.data() + kWordBytes * k);
  }
}

int keyed_sign(const Key& key, std::string_view domain, std::uint64_t index) {
  return (keyed_u64(key, domain, index / 64) >> (index % 64)) & 1 ? 1 : -1;
}

void keyed_signs(const Key& key, std::string_view domain, std::span<std::int8_t> out) {
  ensure_sodium();
  HashInput input(domain);
  Block block;
  constexpr std::size_t kBits = 8 * sizeof(Block);
  for (std::size_t begin = 0; begin < out.size(); begin += kBits) {
    input.hash(key, begin / kBits, block);
    // Little-endian words: bit k of the block is bit (k mod 8) of byte (k div 8).
    const std::size_t count = std::min(kBits, out.size() - begin);
    for (std::size_t k = 0; k < count; ++k) {
      out[begin + k] = static_cast<std::int8_t>(((block[k / 8] >> (k % 8)) & 1) ? 1 : -1);
    }
  }
}

std::vector<Index> keyed_order(const Key& key, std::string_view domain, Index n) {
  if (n < 0) throw ValueError("[keyed_order] n must be at least 0, got " + std::to_string(n));
  std::vector<std::uint64_t> words(static_cast<std::size_t>(n));
  keyed_words(key, domain, words);
  std::vector<std::pair<std::uint64_t, Index>> items(words.size());
  for (std::size_t i = 0; i < words.size(); ++i) items[i] = {words[i], static_cast<Index>(i)};
  std::sort(items.begin(), items.end());
  std::vector<Index> order(words.size());
  std::transform(items.begin(), items.end(), order.begin(), [](const auto& item) { return item.second; });
  return order;
}

Key derive_key(const Key& key, std::string_view domain, std::uint64_t index) {
  ensure_sodium();
  Key derived;
  HashInput(domain).hash(key, index, derived.bytes);
  return derived;
}

}  // namespace fieldmark::watermark
