#include <fieldmark/core/sodium.h>
#include <fieldmark/watermark/keys/keyed_hash.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <string>
#include <vector>

namespace fieldmark::watermark {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::size_t kWordBytes = sizeof(std::uint64_t);

// The hashed message; only its counter changes from block to block. The leading length separates the streams
// of all domains.
class HashInput {
 public:
  explicit HashInput(std::string_view domain) : bytes_(kWordBytes, '\0') {
    const std::uint64_t length = domain.size();
    std::memcpy(bytes_.data(), &length, kWordBytes);
    bytes_.append(domain).append(kWordBytes, '\0');
  }
  // Fills all of `out`.
  template <class Out>
  void hash(const Key& key, std::uint64_t counter, Out& out) {
    std::memcpy(bytes_.data() + bytes_.size() - kWordBytes, &counter, kWordBytes);
    crypto_generichash(reinterpret_cast<unsigned char*>(out.data()), sizeof(Out),
                       reinterpret_cast<const unsigned char*>(bytes_.data()), bytes_.size(), key.bytes.data(),
                       key.bytes.size());
  }

 private:
  std::string bytes_;
};

}  // namespace

void keyed_words(const Key& key, std::string_view domain, std::span<std::uint64_t> out) {
  ensure_sodium();
  HashInput input(domain);
  std::array<std::uint64_t, 8> block;
  for (std::size_t begin = 0; begin < out.size(); begin += block.size()) {
    input.hash(key, begin / block.size(), block);
    std::copy_n(block.begin(), std::min(block.size(), out.size() - begin),
                out.begin() + static_cast<std::ptrdiff_t>(begin));
  }
}

void keyed_signs(const Key& key, std::string_view domain, std::span<std::int8_t> out) {
  std::vector<std::uint64_t> words((out.size() + 63) / 64);
  keyed_words(key, domain, words);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = (words[i / 64] >> (i % 64)) & 1 ? 1 : -1;
}

Key derive_key(const Key& key, std::string_view domain, std::uint64_t index) {
  ensure_sodium();
  Key derived;
  HashInput(domain).hash(key, index, derived.bytes);
  return derived;
}

Key key_of_seed(std::uint64_t seed) {
  Key key;
  for (std::size_t k = 0; k < sizeof(seed); ++k) key.bytes[k] = static_cast<std::uint8_t>(seed >> (8 * k));
  return key;
}

}  // namespace fieldmark::watermark
