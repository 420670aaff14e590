#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace fieldmark::cli {

/// A public data set, as described by data_manifests/NAME.json.
struct Manifest {
  struct File {
    std::string path;  ///< below the data set's folder
    std::uintmax_t bytes = 0;
    std::string sha256;  ///< 64 hexadecimal digits
  };
  std::string name, kind, title, licence, citation, url;
  std::string base_url{};  ///< http or https; a file's URL is base_url + path; empty if unknown
  std::vector<File> files;
  std::uintmax_t bytes() const;
};

/// Returns the contents of data_manifests/, compiled into the program.
std::vector<std::string_view> embedded_manifests();

/// Parses a manifest. @param origin  named in errors   @throws IoError if the text is not JSON or not a
/// manifest of format 1
Manifest parse_manifest(std::string_view text, const std::string& origin);

/// Returns the fault of a file: missing, wrong size or wrong SHA-256; empty if it is correct.
/// @throws IoError if it cannot be read
std::string file_fault(const Manifest::File& file, const std::filesystem::path& path);

struct ManifestFault {
  std::string path, what;
};
/// Compares a folder with a manifest: each file's presence, size and SHA-256. Other files are ignored.
/// @param keep_going  called before every file with the fraction of bytes checked; false ends the check early
std::vector<ManifestFault> verify_manifest(const Manifest& manifest, const std::filesystem::path& folder,
                                           const std::function<bool(double)>& keep_going);

}  // namespace fieldmark::cli
