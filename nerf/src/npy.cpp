#include "npy.h"

#include <fieldmark/core/error.h>

#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <regex>
#include <string>

namespace fieldmark::nerf {
namespace {
static_assert(std::endian::native == std::endian::little, "elements are copied as they lie in memory");
using Json = nlohmann::json;
constexpr std::string_view kMagic = "\x93NUMPY";

// Converts the header, a Python dictionary of a string, a bool and a tuple, to JSON; returns a discarded
// value for anything else.
Json header_json(std::string text) {
  for (const auto& [python, json] : {std::pair{"'", "\""},
                                     {"\\(", "["},
                                     {"\\)", "]"},
                                     {",\\s*([\\]}])", "$1"},
                                     {"True", "true"},
                                     {"False", "false"}})
    text = std::regex_replace(text, std::regex(python), json);
  return Json::parse(text, nullptr, false);
}

template <class T>
std::vector<double> numbers(const char* from, std::size_t count) {
  std::vector<T> read(count);
  if (count > 0) std::memcpy(read.data(), from, count * sizeof(T));
  return {read.begin(), read.end()};
}
// Reorders an array from first index fastest (Fortran) to last index fastest (C).
std::vector<double> in_c_order(const NpyArray& array) {
  std::vector<double> ordered(array.numbers.size());
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    std::size_t rest = i, place = 0;
    for (const Index extent : array.shape) {
      place = place * static_cast<std::size_t>(extent) + rest % static_cast<std::size_t>(extent);
      rest /= static_cast<std::size_t>(extent);
    }
    ordered[place] = array.numbers[i];
  }
  return ordered;
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
  const std::size_t most = std::min<std::size_t>(bytes.size() - begin, 4096);
  if (length > most)
    fail(8, "a header of at most " + std::to_string(most) + " bytes", std::to_string(length));
  const Json header = header_json(std::string(bytes.substr(begin, length)));
  if (!header.is_object()) fail(begin, "a Python dictionary", "something else");
  for (const char* key : {"descr", "fortran_order", "shape"})
    if (!header.contains(key))
      fail(begin, "the keys descr, fortran_order and shape", "none called " + std::string(key));
  const auto found = [&](const char* key) {
    return header[key].dump(-1, ' ', true, Json::error_handler_t::replace);
  };
  if (header["descr"] != "<f4" && header["descr"] != "<f8")
    fail(begin, "descr '<f4' or '<f8' (little-endian floats)", found("descr"));
  if (!header["fortran_order"].is_boolean())
    fail(begin, "fortran_order True or False", found("fortran_order"));

  const std::size_t data = begin + length, left = bytes.size() - data,
                    each = header["descr"] == "<f4" ? 4 : 8;
  NpyArray array;
  std::size_t count = 1;  // capped above the bytes left, before it can overflow
  if (!header["shape"].is_array()) fail(begin, "a tuple for shape", found("shape"));
  for (const Json& n : header["shape"]) {
    if (!n.is_number_unsigned() || n > std::size_t{1} << 60)
      fail(begin, "whole numbers from 0 for shape", found("shape"));
    const auto extent = n.get<std::size_t>();
    array.shape.push_back(static_cast<Index>(extent));
    count = extent == 0 || count <= (left + 1) / extent ? count * extent : left + 1;
  }
  if (count > left / each || count * each != left)
    fail(data,
         (count > left ? "more elements than the file has bytes"
                       : std::to_string(count * each) + " bytes of elements") +
             " for the shape in the header",
         std::to_string(left) + " bytes");
  array.numbers =
      each == 4 ? numbers<float>(bytes.data() + data, count) : numbers<double>(bytes.data() + data, count);
  if (header["fortran_order"] == true) array.numbers = in_c_order(array);
  return array;
}

}  // namespace fieldmark::nerf
