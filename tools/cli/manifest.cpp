#include "cli/manifest.h"

#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace fieldmark::cli {
namespace {

bool is_sha256(const std::string& text) {
  return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

// A path that leaves the data set's folder could make `verify` and later tools read or write anywhere.
bool stays_below(const std::filesystem::path& path) {
  return !path.empty() && path.is_relative() && std::find(path.begin(), path.end(), "..") == path.end();
}

Manifest from_json(const nlohmann::json& json) {
  if (json.at("format") != 1) throw IoError("format: expected 1, found " + json.at("format").dump());
  Manifest m{.name = json.at("name"),
             .kind = json.at("kind"),
             .title = json.at("title"),
             .licence = json.at("licence"),
             .citation = json.at("source").at("citation"),
             .url = json.at("source").at("url"),
             .base_url = json.value("base_url", ""),
             .files = {}};
  if (!m.base_url.empty() && !m.base_url.starts_with("http://") && !m.base_url.starts_with("https://"))
    throw IoError("base_url: expected http:// or https://, found " + m.base_url);
  for (const auto& file : json.at("files")) {
    m.files.push_back({file.at("path"), file.at("bytes"), file.at("sha256")});
    const auto& f = m.files.back();
    if (!stays_below(f.path)) throw IoError("files: path must stay in the folder, found " + f.path);
    if (!is_sha256(f.sha256)) throw IoError("files: sha256 of " + f.path + " must be 64 hexadecimal digits");
  }
  return m;
}

}  // namespace

std::string file_fault(const Manifest::File& file, const std::filesystem::path& path) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  if (error) return "missing";
  if (bytes != file.bytes)
    return "expected " + std::to_string(file.bytes) + " bytes, found " + std::to_string(bytes);
  const std::string found = sha256_file_hex(path);
  return found == file.sha256 ? "" : "expected sha256 " + file.sha256 + ", found " + found;
}

std::uintmax_t Manifest::bytes() const {
  std::uintmax_t sum = 0;
  for (const auto& file : files) sum += file.bytes;
  return sum;
}

Manifest parse_manifest(std::string_view text, const std::string& origin) {
  try {
    return from_json(nlohmann::json::parse(text));
  } catch (const std::exception& e) {
    throw IoError(origin + ": not a manifest of a data set: " + e.what());
  }
}

std::vector<ManifestFault> verify_manifest(const Manifest& manifest, const std::filesystem::path& folder,
                                           const std::function<bool(double)>& keep_going) {
  std::vector<ManifestFault> faults;
  const double all = static_cast<double>(std::max<std::uintmax_t>(manifest.bytes(), 1));
  std::uintmax_t seen = 0;
  for (const auto& file : manifest.files) {
    if (!keep_going(static_cast<double>(seen) / all)) break;
    if (auto what = file_fault(file, folder / file.path); !what.empty())
      faults.push_back({file.path, std::move(what)});
    seen += file.bytes;
  }
  return faults;
}

}  // namespace fieldmark::cli
