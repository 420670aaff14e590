#pragma once
// The two ways a COLMAP file is written, read record by record through one set of calls. Private.
#include <fieldmark/core/error.h>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace fieldmark::nerf {

constexpr double kColmapMost = 1e9;  // of any number: sums and products stay finite

inline void check_colmap_number(double x, const char* what, const auto& fail) {
  if (!(std::abs(x) < kColmapMost)) fail(std::string(what) + " in (-1e9, 1e9)", std::to_string(x));
}

/// Numbers in memory order, with counts that are checked against the bytes left.
class ColmapBytes {
 public:
  ColmapBytes(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    throw IoError(std::string(name_) + ": byte " + std::to_string(at_) + ": expected " + expected + ", got " +
                  got);
  }
  template <class T>
  T get(const char* what) {
    if (bytes_.size() - at_ < sizeof(T)) fail(what, "the end of the file");
    T x;
    std::memcpy(&x, bytes_.data() + at_, sizeof(T));
    at_ += sizeof(T);
    return x;
  }
  double number(const char* what) {
    const double x = get<double>(what);
    check_colmap_number(x, what, [&](const auto& e, const auto& g) { fail(e, g); });
    return x;
  }
  /// @param least  bytes that each takes at least
  std::uint64_t count(std::size_t least, const char* what) {
    const auto n = get<std::uint64_t>(what);
    if (n > (bytes_.size() - at_) / least)
      fail(std::string(what) + " of at most " + std::to_string((bytes_.size() - at_) / least) +
               " in the bytes left",
           std::to_string(n));
    return n;
  }
  std::string text(const char* what) {
    const std::size_t end = bytes_.find('\0', at_);
    if (end == std::string_view::npos) fail(what, "no byte 0 that ends it");
    std::string found(bytes_.substr(at_, end - at_));
    at_ = end + 1;
    return found;
  }
  void skip(std::uint64_t bytes) { at_ += static_cast<std::size_t>(bytes); }
  void end() const {
    if (at_ != bytes_.size())
      fail("the end of the file", std::to_string(bytes_.size() - at_) + " bytes more");
  }

 private:
  std::string_view bytes_, name_;
  std::size_t at_ = 0;
};

/// Lines of words between blanks.
class ColmapLines {
 public:
  ColmapLines(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    throw IoError(std::string(name_) + ": line " + std::to_string(number_) + ": expected " + expected +
                  ", got " + got);
  }
  /// The next line, whatever it holds; false at the end.
  bool next() {
    if (at_ >= bytes_.size()) return false;
    const std::size_t end = std::min(bytes_.find('\n', at_), bytes_.size());
    line_ = bytes_.substr(at_, end - at_);
    at_ = end + 1, ++number_;
    return true;
  }
  /// The next line that is neither empty nor a comment.
  bool next_record() {
    while (next()) {
      trim();
      if (!line_.empty() && line_.front() != '#') return true;
    }
    return false;
  }
  bool at_end() {
    trim();
    return line_.empty();
  }
  std::string_view word(const char* what) {
    trim();
    if (line_.empty()) fail(what, "the end of the line");
    const std::size_t end = std::min(line_.find_first_of(" \t\r"), line_.size());
    const std::string_view w = line_.substr(0, end);
    line_.remove_prefix(end);
    return w;
  }
  /// What is left of the line.
  std::string rest(const char* what) {
    trim();
    while (!line_.empty() && (line_.back() == '\r' || line_.back() == ' ')) line_.remove_suffix(1);
    if (line_.empty()) fail(what, "the end of the line");
    return std::string(line_);
  }
  template <class T>
  T get(const char* what) {
    const std::string_view w = word(what);
    T x{};
    const auto [stop, error] = std::from_chars(w.data(), w.data() + w.size(), x);
    if (error != std::errc() || stop != w.data() + w.size())
      fail(what, "'" + std::string(w.substr(0, 40)) + "'");
    return x;
  }
  double number(const char* what) {
    const double x = get<double>(what);
    check_colmap_number(x, what, [&](const auto& e, const auto& g) { fail(e, g); });
    return x;
  }

 private:
  void trim() {
    const std::size_t first = line_.find_first_not_of(" \t\r");
    line_.remove_prefix(std::min(first, line_.size()));
  }
  std::string_view bytes_, name_, line_;
  std::size_t at_ = 0, number_ = 0;
};

}  // namespace fieldmark::nerf
