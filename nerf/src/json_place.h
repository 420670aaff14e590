#pragma once
// A value inside a JSON text together with its place, which errors name.
#include <fieldmark/core/error.h>
#include <fieldmark/nerf/camera.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

namespace fieldmark::nerf {

class JsonPlace {
 public:
  JsonPlace(const nlohmann::json& value, std::string file) : JsonPlace(value, std::move(file), "") {}

  [[noreturn]] void fail(const std::string& expected, const std::string& got) const {
    throw IoError(file_ + ": " + (place_.empty() ? "" : place_ + ": ") + "expected " + expected + ", got " +
                  got);
  }
  const std::string& place() const { return place_; }
  bool has(const char* key) const { return value_->is_object() && value_->contains(key); }
  JsonPlace operator[](const char* key) const {
    if (!value_->is_object()) fail("an object", kind());
    const auto found = value_->find(key);
    if (found == value_->end()) fail("the key \"" + std::string(key) + "\"", "none");
    return {*found, file_, place_.empty() ? key : place_ + "." + key};
  }
  JsonPlace at(std::size_t i) const { return {(*value_)[i], file_, place_ + "[" + std::to_string(i) + "]"}; }
  std::size_t array_size() const {
    if (!value_->is_array()) fail("an array", kind());
    return value_->size();
  }
  double number() const {
    if (!value_->is_number()) fail("a number", kind());
    const double x = value_->get<double>();
    if (!std::isfinite(x)) fail("a finite number", std::to_string(x));
    return x;
  }
  double number_in(double low, double high, const std::string& range) const {
    const double x = number();
    if (!(x > low && x < high)) fail("a number in " + range, std::to_string(x));
    return x;
  }
  /// A side of an image, pixels.
  Index side() const { return std::lround(number_in(0.5, 65536.5, "1 to 65536")); }
  std::string text() const {
    if (!value_->is_string()) fail("text", kind());
    return value_->get<std::string>();
  }
  bool is_zero() const { return value_->is_number() && value_->get<double>() == 0; }
  bool is_null() const { return value_->is_null(); }
  bool is_false() const { return value_->is_boolean() && !value_->get<bool>(); }
  Vec3 vec3() const {
    if (array_size() != 3) fail("3 numbers", std::to_string(array_size()));
    return {at(0).number(), at(1).number(), at(2).number()};
  }
  std::string kind() const { return value_->type_name(); }

 private:
  JsonPlace(const nlohmann::json& value, std::string file, std::string place)
      : value_(&value), file_(std::move(file)), place_(std::move(place)) {}
  const nlohmann::json* value_;
  std::string file_, place_;
};

/// @throws IoError with line and byte if the text is not JSON
inline nlohmann::json parse_json(std::string_view text, std::string_view file) {
  const auto fail = [&](std::size_t byte, const std::string& found) {
    byte = std::min(byte, text.size());
    const auto line = 1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(byte), '\n');
    throw IoError(std::string(file) + ": line " + std::to_string(line) + ", byte " + std::to_string(byte) +
                  ": expected JSON, got " + found);
  };
  try {
    return nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& e) {
    // e.byte counts from 1 and points at the last byte read.
    const std::size_t at = e.byte > 0 ? e.byte - 1 : 0;
    if (at >= text.size()) fail(text.size(), "the end of the text");
    const auto c = static_cast<unsigned char>(text[at]);
    fail(at, c >= 0x20 && c < 0x7F ? std::string("'") + text[at] + "'" : "byte value " + std::to_string(c));
  } catch (const nlohmann::json::out_of_range& e) {
    // A number too large for a double; the parser names it in quotes but not its place.
    const std::string what = e.what();
    const auto last = what.rfind('\''), first = what.rfind('\'', last - 1);
    const std::string number = what.substr(first + 1, last - first - 1);
    fail(text.find(number), "the number " + number + ", too large");
  }
  return {};
}

}  // namespace fieldmark::nerf
