#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "cli/manifest.h"

namespace fieldmark::cli {

/// Asked while bytes come in, with their number so far; false ends the work and keeps what came.
using FetchProgress = std::function<bool(std::uintmax_t)>;

/// Fetches one file over http or https into `to`.part, goes on where an earlier call was cut off (unless the
/// server sends the whole file again), checks size and SHA-256, and renames it to `to`.
/// @return false if `progress` ended it
/// @throws IoError  naming the address: no connection, an HTTP status that is an error, a connection that
/// ended
///                  early (the part is kept), more bytes than expected or another SHA-256 (the part is
///                  removed)
bool fetch_file(const std::string& url, const std::filesystem::path& to, const Manifest::File& expected,
                const FetchProgress& progress);

/// What fetch_manifest() did.
struct Fetched {
  std::size_t fetched = 0;  ///< files
  std::size_t present = 0;  ///< files that were there and right
  bool complete = true;     ///< false if `progress` ended it
};
/// Brings every file of a data set that is missing or wrong into a folder, from base_url + path with the
/// characters that an address may not have percent-encoded.
/// @param progress  asked with the bytes of all files that are there
/// @throws IoError as fetch_file(), or if the manifest has no base_url: the text says where to get it by hand
Fetched fetch_manifest(const Manifest& manifest, const std::filesystem::path& folder,
                       const FetchProgress& progress);

}  // namespace fieldmark::cli
