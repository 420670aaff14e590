#pragma once
#include <fieldmark/engine/safetensors.h>

#include <string>
#include <vector>

namespace fieldmark::cli {

/// Returns the SHA-256 of all tensors of an OWNER but the key: unmarked field, cells, mark and extractor.
/// Embedding with equal options gives the same hash under any key. It is the SHA-256 of a text with this line
/// for each tensor; the lines are sorted by their bytes, and a line feed ends each:
///   NAME DTYPE [SHAPE] SHA-256-OF-ITS-DATA
/// @param owner  the OWNER file
std::string networks_sha256(const SafetensorsFile& owner);

/// Returns the SHA-256 of a list of recipients in any order, so that its owner can time-stamp the list before
/// tracing. It is the SHA-256 of the names, sorted by their bytes (UTF-8), with a line feed after each.
/// `LC_ALL=C sort NAMES | sha256sum` computes it for a file that has nothing but names and line feeds.
std::string recipients_sha256(const std::vector<std::string>& names);

}  // namespace fieldmark::cli
