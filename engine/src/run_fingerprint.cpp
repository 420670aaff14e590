#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/engine/run_fingerprint.h>

#include <nlohmann/json.hpp>

namespace fieldmark {
namespace {

using nlohmann::json;

// Flattens objects to names with slashes; an array is one value.
void flatten(const std::string& name, const json& value, json& to) {
  if (!value.is_object()) {
    to[name] = value;
    return;
  }
  for (const auto& [key, inner] : value.items()) flatten(name + "/" + key, inner, to);
}

json read(const SafetensorsFile& file, const char* key) {
  require_kind(file, "checkpoint");
  const auto text = file.metadata.find(key);
  json object = text == file.metadata.end() ? json() : json::parse(text->second, nullptr, false);
  if (!object.is_object())
    throw IoError(file.path + ": metadata entry '" + key +
                  "': expected the JSON object of a checkpoint, found none (of an earlier version?)");
  return object;
}

// Returns the first name whose values differ, or an empty string.
std::string difference(const json& a, const json& b) {
  for (const auto* object : {&a, &b})
    for (const auto& [name, value] : object->items())
      if (a.value(name, json()) != b.value(name, json())) return name;
  return {};
}

std::string shown(const json& object, const std::string& name) {
  if (!object.contains(name)) return "none";
  const std::string text = object[name].dump();
  return text.size() > 60 ? text.substr(0, 57) + "..." : text;
}

json options_json(const std::map<std::string, std::string>& options) {
  json object = json::object();
  for (const auto& [name, text] : options) object[name] = json::parse(text);
  return object;
}

}  // namespace

void RunFingerprint::add(std::string_view name, std::string_view text) {
  json value = json::parse(text, nullptr, false);
  if (value.is_discarded()) value = text;  // nan, inf
  options_[std::string(name)] = value.dump();
}

void RunFingerprint::option(std::string_view name, std::string_view text) {
  options_[std::string(name)] = json(text).dump();
}

void RunFingerprint::options(std::string_view name, std::string_view text) {
  const json object = json::parse(text, nullptr, false);
  if (!object.is_object())
    throw ValueError("[run_fingerprint] options '" + std::string(name) + "' must be a JSON object, got '" +
                     std::string(text.substr(0, 60)) + "'");
  json flat = json::object();
  flatten(std::string(name), object, flat);
  for (const auto& [key, value] : flat.items()) options_[key] = value.dump();
}

void RunFingerprint::hash_input(std::string_view name, std::span<const std::byte> bytes) {
  input_digest(name, sha256_hex(bytes));
}

void RunFingerprint::write(SafetensorsFile& file) const {
  set_model_info(file, {.kind = "checkpoint"});
  file.metadata["options"] = options_json(options_).dump();
  file.metadata["inputs"] = json(inputs_).dump();
}

void RunFingerprint::require(const SafetensorsFile& file) const {
  const json theirs = read(file, "options"), ours = options_json(options_);
  if (const std::string name = difference(theirs, ours); !name.empty())
    throw IoError(file.path + ": this checkpoint was made with option '" + name + "' " + shown(theirs, name) +
                  ", this run has " + shown(ours, name));
  if (const std::string name = difference(read(file, "inputs"), json(inputs_)); !name.empty())
    throw IoError(file.path + ": this checkpoint was made of another input '" + name + "'");
}

std::string RunFingerprint::options_of(const SafetensorsFile& file, std::string_view name) {
  const std::string prefix = std::string(name) + "/";
  const json options = read(file, "options");
  json object;
  for (const auto& [key, value] : options.items())
    if (key.starts_with(prefix)) object[json::json_pointer(key.substr(prefix.size() - 1))] = value;
  if (object.is_null())
    throw IoError(file.path + ": expected a checkpoint with options '" + prefix + "...', found none");
  return object.dump();
}

}  // namespace fieldmark
