#include "canonical_json.h"
#include <fieldmark/core/error.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;  // sorts members by name
constexpr int kLevels = 32;

std::string number_text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.9e", value);
  return text;
}

class Writer {
 public:
  explicit Writer(std::string_view name) : name_(name) {}
  void write(const Json& value, int level) {
    if (level > kLevels)
      throw IoError(std::string(name_) + ": expected at most " + std::to_string(kLevels) + " levels of JSON");
    if (value.is_object())
      members(value, level);
    else if (value.is_array())
      entries(value, level);
    else
      text += value.is_number_float() ? number_text(value.get<double>()) : value.dump();
  }
  std::string text{};

 private:
  void members(const Json& value, int level) {
    text += "{";
    const char* before = "";
    for (const auto& [key, member] : value.items()) {
      text += before + line(level + 1) + Json(key).dump() + ": ";
      write(member, level + 1);
      before = ",";
    }
    text += (value.empty() ? "" : line(level)) + "}";
  }
  void entries(const Json& value, int level) {
    const bool plain =
        std::none_of(value.begin(), value.end(), [](const Json& entry) { return entry.is_structured(); });
    text += "[";
    const char* before = "";
    for (const Json& entry : value) {
      text += before + (plain ? std::string(*before ? " " : "") : line(level + 1));
      write(entry, level + 1);
      before = ",";
    }
    text += (plain ? "" : line(level)) + "]";
  }
  static std::string line(int level) { return "\n" + std::string(2 * static_cast<std::size_t>(level), ' '); }

  std::string_view name_;
};

}  // namespace

std::string canonical_json(std::string_view json, std::string_view name) {
  Writer writer(name);
  try {
    writer.write(Json::parse(json), 0);
  } catch (const Json::exception& e) {
    throw IoError(std::string(name) + ": expected JSON: " + e.what());
  }
  return writer.text + "\n";
}

}  // namespace fieldmark::watermark
