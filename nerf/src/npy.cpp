#include "npy.h"
#include <fieldmark/core/error.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>

namespace fieldmark::nerf {
namespace {
static_assert(std::endian::native == std::endian::little, "numbers are copied as they lie in memory");
constexpr std::string_view kMagic = "\x93NUMPY";

// The header is a Python dictionary of a text, a truth value and a tuple of whole numbers, in any order.
class Header {
 public:
  Header(std::string_view bytes, std::size_t begin, std::size_t end, std::string_view name)
      : bytes_(bytes), at_(begin), end_(end), name_(name) {}

  void parse() {
    take('{');
    while (!is('}')) {
      const std::string key = quoted();
      take(':');
      if (key == "descr" && !descr)
        descr = quoted();
      else if (key == "fortran_order" && !fortran)
        fortran = truth();
      else if (key == "shape" && !shape)
        shape = tuple();
      else
        fail("the keys descr, fortran_order and shape once each", "'" + key + "'");
      if (!is('}')) take(',');
    }
    ++at_;
    skip();
    if (at_ != end_) fail("the end of the header after '}'", found());
    if (!descr || !fortran || !shape)
      fail("the keys descr, fortran_order and shape",
           std::string("none called ") + (!descr     ? "descr"
                                          : !fortran ? "fortran_order"
                                                     : "shape"));
  }

  std::optional<std::string> descr;
  std::optional<bool> fortran;
  std::optional<std::vector<Index>> shape;

 private:
  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    throw IoError(std::string(name_) + ": byte " + std::to_string(at_) + ": expected " + expected + ", got " +
                  got);
  }
  std::string found() const {
    if (at_ >= end_) return "the end of the header";
    const auto c = static_cast<unsigned char>(bytes_[at_]);
    return c >= 0x20 && c < 0x7F ? std::string("'") + bytes_[at_] + "'" : "byte value " + std::to_string(c);
  }
  void skip() {
    while (at_ < end_ && (bytes_[at_] == ' ' || bytes_[at_] == '\n')) ++at_;
  }
  bool is(char c) {
    skip();
    return at_ < end_ && bytes_[at_] == c;
  }
  void take(char c) {
    if (!is(c)) fail(std::string("'") + c + "'", found());
    ++at_;
  }
  std::string quoted() {
    const char quote = is('"') ? '"' : '\'';
    take(quote);
    const std::size_t close = bytes_.substr(0, end_).find(quote, at_);
    if (close == std::string_view::npos) fail("a closing quote", "the end of the header");
    std::string text(bytes_.substr(at_, close - at_));
    at_ = close + 1;
    return text;
  }
  bool truth() {
    skip();
    for (const auto& [word, value] : {std::pair<std::string_view, bool>{"True", true}, {"False", false}})
      if (bytes_.substr(at_, end_ - at_).starts_with(word)) {
        at_ += word.size();
        return value;
      }
    fail("True or False", found());
  }
  std::vector<Index> tuple() {
    std::vector<Index> extents;
    take('(');
    while (!is(')')) {
      Index n = 0;
      const std::size_t begin = at_;
      for (; at_ < end_ && bytes_[at_] >= '0' && bytes_[at_] <= '9' && at_ - begin < 18; ++at_)
        n = 10 * n + (bytes_[at_] - '0');
      if (at_ == begin) fail("a whole number from 0", found());
      extents.push_back(n);
      if (!is(')')) take(',');
    }
    ++at_;
    return extents;
  }

  std::string_view bytes_;
  std::size_t at_, end_;
  std::string_view name_;
};

template <class T>
std::vector<double> numbers(const char* from, std::size_t count) {
  std::vector<double> out(count);
  for (std::size_t i = 0; i < count; ++i) {
    T x;
    std::memcpy(&x, from + i * sizeof(T), sizeof(T));
    out[i] = static_cast<double>(x);
  }
  return out;
}
}  // namespace

NpyArray parse_npy(std::string_view bytes, std::string_view name) {
  const auto fail = [&](std::size_t byte, const std::string& expected, const std::string& got) {
    throw IoError(std::string(name) + ": byte " + std::to_string(byte) + ": expected " + expected + ", got " +
                  got);
  };
  if (!bytes.starts_with(kMagic)) fail(0, "an .npy file, which begins with \\x93NUMPY", "something else");
  if (bytes.size() < 12) fail(bytes.size(), "12 bytes at least", "the end of the file");
  const int version = static_cast<unsigned char>(bytes[6]);
  if (version < 1 || version > 3) fail(6, "format 1, 2 or 3", std::to_string(version));
  std::uint32_t length = 0;
  const std::size_t begin = version == 1 ? 10 : 12;
  std::memcpy(&length, bytes.data() + 8, begin - 8);
  if (length > bytes.size() - begin)
    fail(8, "a header of at most " + std::to_string(bytes.size() - begin) + " bytes", std::to_string(length));
  const std::size_t data = begin + length;
  Header header(bytes, begin, data, name);
  header.parse();
  if (*header.descr != "<f4" && *header.descr != "<f8")
    fail(begin, "descr '<f4' or '<f8' (little-endian floats)", "'" + *header.descr + "'");
  if (*header.fortran) fail(begin, "fortran_order False (C order)", "True");

  const std::size_t each = *header.descr == "<f4" ? 4 : 8, room = bytes.size() - data;
  // A product past the bytes there are is wrong however large: it is cut off before it can overflow.
  std::size_t count = 1;
  for (const Index n : *header.shape) {
    const auto extent = static_cast<std::size_t>(n);
    count = extent == 0 || count <= (room + 1) / extent ? count * extent : room + 1;
  }
  if (count > room / each || count * each != room)
    fail(data,
         (count > room ? "more numbers than the file has bytes"
                       : std::to_string(count * each) + " bytes of numbers") +
             " for the shape in the header",
         std::to_string(room) + " bytes");
  return {std::move(*header.shape), each == 4 ? numbers<float>(bytes.data() + data, count)
                                              : numbers<double>(bytes.data() + data, count)};
}

}  // namespace fieldmark::nerf
