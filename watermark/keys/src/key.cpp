#include <fieldmark/core/error.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/watermark/keys/key.h>

#include <algorithm>

#include <fieldmark/core/sodium.h>

namespace fieldmark::watermark {
namespace {
constexpr char kKind[] = "key";
constexpr char kArray[] = "key";
}  // namespace

Key random_key() {
  ensure_sodium();
  Key key;
  randombytes_buf(key.bytes.data(), key.bytes.size());
  return key;
}

Key key_from_bytes(std::span<const std::uint8_t> bytes) {
  Key key;
  if (bytes.size() != key.bytes.size()) {
    throw ValueError("[key_from_bytes] bytes: must have " + std::to_string(key.bytes.size()) +
                     " entries, got " + std::to_string(bytes.size()));
  }
  std::copy(bytes.begin(), bytes.end(), key.bytes.begin());
  return key;
}

std::string to_hex(const Key& key) {
  std::string text(2 * key.bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), key.bytes.data(), key.bytes.size());
  text.pop_back();
  return text;
}

void save_key(const std::filesystem::path& path, const Key& key) {
  SafetensorsFile file;
  set_model_info(file, {.kind = kKind});
  file.add(kArray, {static_cast<Index>(key.bytes.size())}, std::span<const std::uint8_t>(key.bytes));
  file.write(path, Access::secret);
}

Key load_key(const std::filesystem::path& path) {
  const SafetensorsFile file = SafetensorsFile::read(path);
  require_kind(file, kKind);
  const std::vector<std::uint8_t> bytes = file.u8(kArray);
  if (bytes.size() != Key{}.bytes.size()) {
    throw IoError(path.string() + ": tensor \"" + kArray + "\": expected " +
                  std::to_string(Key{}.bytes.size()) + " bytes, found " + std::to_string(bytes.size()));
  }
  return key_from_bytes(bytes);
}

}  // namespace fieldmark::watermark
