#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/watermark/keys/keyed_hash.h>
#include <fieldmark/watermark/tracing/copies.h>

#include <algorithm>
#include <map>
#include <sstream>

namespace fieldmark::watermark {

Key copy_key(const Key& key, std::string_view name) {
  if (name.empty()) throw ValueError("[copy_key] name must not be empty");
  return derive_key(key, "fieldmark copy " + std::string(name), 0);
}

void check_recipient(std::string_view name) {
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  if (name.empty() || name.front() == ' ' || name.back() == ' ' || std::ranges::any_of(name, is_control))
    throw ValueError("recipient: expected a name without spaces at its ends or control characters, got '" +
                     std::string(name) + "'");
}

std::vector<std::string> read_recipients(const std::filesystem::path& path) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // of some editors
  std::string text = read_text(path);
  if (text.starts_with(kByteOrderMark)) text.erase(0, kByteOrderMark.size());
  std::istringstream lines(text);
  std::vector<std::string> names;
  std::map<std::string, std::size_t> line_of;
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos) continue;
    names.push_back(line.substr(first, line.find_last_not_of(" \t\r") - first + 1));
    try {
      check_recipient(names.back());
    } catch (const ValueError& e) {
      throw IoError(path.string() + ": line " + std::to_string(number) + ": " + e.what());
    }
    const auto [known, is_new] = line_of.emplace(names.back(), number);
    if (!is_new)
      throw IoError(path.string() + ": line " + std::to_string(number) +
                    ": expected each recipient once, found '" + names.back() + "' of line " +
                    std::to_string(known->second) + " again");
  }
  if (names.empty()) throw IoError(path.string() + ": expected one recipient a line, found none");
  return names;
}

}  // namespace fieldmark::watermark
