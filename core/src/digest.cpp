#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <vector>

#include <fieldmark/core/sodium.h>

namespace fieldmark {
namespace {
class Sha256 {
 public:
  Sha256() {
    ensure_sodium();
    crypto_hash_sha256_init(&state_);
  }
  void add(const void* data, std::size_t size) {
    crypto_hash_sha256_update(&state_, static_cast<const unsigned char*>(data), size);
  }
  std::string hex() {
    std::array<unsigned char, crypto_hash_sha256_BYTES> digest;
    crypto_hash_sha256_final(&state_, digest.data());
    std::string text(2 * digest.size() + 1, '\0');
    sodium_bin2hex(text.data(), text.size(), digest.data(), digest.size());
    text.pop_back();
    return text;
  }

 private:
  crypto_hash_sha256_state state_;
};
}  // namespace

std::string sha256_hex(std::span<const std::byte> bytes) {
  Sha256 sha;
  sha.add(bytes.data(), bytes.size());
  return sha.hex();
}

std::string sha256_hex(std::string_view text) { return sha256_hex(std::as_bytes(std::span(text))); }

std::string sha256_file_hex(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) {
    throw IoError(path.string() + ": cannot be opened for reading, expected a file, found: " +
                  (file ? "a folder" : std::strerror(errno)));
  }
  Sha256 sha;
  std::vector<char> buffer(std::size_t{1} << 20);
  std::uint64_t offset = 0;
  while (file) {
    file.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    sha.add(buffer.data(), static_cast<std::size_t>(file.gcount()));
    offset += static_cast<std::uint64_t>(file.gcount());
  }
  if (!file.eof()) throw IoError(path.string() + ": byte " + std::to_string(offset) + ": cannot be read");
  return sha.hex();
}

}  // namespace fieldmark
