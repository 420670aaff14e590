#include <fieldmark/core/error.h>
#include <fieldmark/engine/model_file.h>

#include <nlohmann/json.hpp>

namespace fieldmark {
namespace {
using nlohmann::json;
constexpr char kEntry[] = "fieldmark";
constexpr int kFormat = 1;

[[noreturn]] void fail(const SafetensorsFile& file, const std::string& what) {
  throw IoError(file.path + ": " + what);
}

std::string found(const json& object, const char* key) {
  const auto at = object.find(key);
  return at == object.end() ? "nothing" : at->dump(-1, ' ', true, json::error_handler_t::replace);
}

std::string entry_names(const SafetensorsFile& file) {
  std::string names;
  for (const auto& [name, text] : file.metadata) names += (names.empty() ? "" : ", ") + name;
  return names.empty() ? "none" : names;
}

// "a FIELD", "an OWNER", as in the command line.
std::string with_article(std::string_view kind) {
  std::string upper(kind);
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  const bool vowel =
      !upper.empty() && std::string_view("AEIOU").find(upper.front()) != std::string_view::npos;
  return (vowel ? "an " : "a ") + upper;
}
}  // namespace

void set_model_info(SafetensorsFile& file, const ModelInfo& info) {
  if (info.kind.empty()) throw ValueError("[set_model_info] kind must not be empty, got ''");
  const json config = json::parse(info.config, nullptr, false);
  if (!config.is_object()) {
    throw ValueError("[set_model_info] config must be a JSON object, got '" + info.config.substr(0, 60) +
                     "'");
  }
  json entry{{"format", kFormat}, {"kind", info.kind}};
  if (!config.empty()) entry["config"] = config;
  file.metadata[kEntry] = entry.dump();
}

ModelInfo model_info(const SafetensorsFile& file) {
  const auto text = file.metadata.find(kEntry);
  if (text == file.metadata.end()) {
    fail(file, "not a Fieldmark file: expected the metadata entry 'fieldmark', found " + entry_names(file));
  }
  const std::string where = "metadata entry 'fieldmark': ";
  const json entry = json::parse(text->second, nullptr, false);
  if (!entry.is_object())
    fail(file, where + "expected a JSON object, found '" + text->second.substr(0, 60) + "'");
  // Checked first, because another format may have other keys.
  if (!entry.contains("format") || entry["format"] != kFormat) {
    fail(file, where + "expected format " + std::to_string(kFormat) + ", found " + found(entry, "format"));
  }
  if (!entry.contains("kind") || !entry["kind"].is_string()) {
    fail(file, where + "expected a kind (a string), found " + found(entry, "kind"));
  }
  const json config = entry.value("config", json::object());
  if (!config.is_object())
    fail(file, where + "expected config to be an object, found " + found(entry, "config"));
  return {entry["kind"].get<std::string>(), config.dump()};
}

ModelInfo require_kind(const SafetensorsFile& file, std::string_view kind) {
  ModelInfo info = model_info(file);
  if (info.kind == kind) return info;
  fail(file, "expected " + with_article(kind) + " file (kind '" + std::string(kind) + "'), found kind '" +
                 info.kind + "'");
}

}  // namespace fieldmark
