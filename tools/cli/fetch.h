#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "cli/manifest.h"

namespace fieldmark::cli {

/// Receives the number of bytes so far; returning false stops the transfer and keeps the partial file.
using FetchProgress = std::function<bool(std::uintmax_t)>;

/// Fetches a file over http or https into `to`.part, resuming an earlier transfer if the server allows it.
/// Checks size and SHA-256, then renames the file to `to`.
/// @return false if `progress` stopped it
/// @throws IoError  naming the URL: no connection, an HTTP error, an early end (the part is kept), more bytes
///                  than expected or a different SHA-256 (the part is removed)
bool fetch_file(const std::string& url, const std::filesystem::path& to, const Manifest::File& expected,
                const FetchProgress& progress);

/// Result of fetch_manifest().
struct Fetched {
  std::size_t fetched = 0;  ///< number of files
  std::size_t present = 0;  ///< files that were already present and correct
  bool complete = true;     ///< false if `progress` stopped it
};
/// Downloads every missing or damaged file of a data set from base_url + path, percent-encoded.
/// @param progress  receives the number of bytes of all files present
/// @throws IoError as fetch_file(), or if the manifest has no base_url: the text names the source
Fetched fetch_manifest(const Manifest& manifest, const std::filesystem::path& folder,
                       const FetchProgress& progress);

}  // namespace fieldmark::cli
