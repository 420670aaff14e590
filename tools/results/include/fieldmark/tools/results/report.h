#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace fieldmark::results {

using Json = nlohmann::ordered_json;
using Words = std::vector<std::string>;

/// Everything besides the command and its inputs that a measured figure depends on.
struct Machine {
  std::string commit;    ///< of the sources, plus "+ changes" if they were modified; "unknown" outside of git
  std::string cpu;       ///< model name
  std::string isa;       ///< "v2", "v3" or "v4": the kernels in use
  std::string compiler;  ///< name, version and flags
  int threads = 1;       ///< of this process
};
Machine machine();

/// Returns the SHA-256 of the sources of some rooms at this build, without comments and spaces, so that a
/// result expires with its code.
/// @param rooms  folders; one without sources of its own, such as "watermark", stands for all rooms in it
/// @throws ValueError for a folder without sources
std::string code_hash(const Words& rooms);

/// Strips private paths from a command line: files below $FIELDMARK_DATA are shown relative to it, other
/// absolute paths by their last component.
std::string published_command(const Words& command_line);

/// Formats a number or word of a result: six significant digits, "-" for null.
std::string shown(const Json& value);

/// Formats a Markdown table. Every row has as many cells as the header.
std::string markdown_table(const Words& header, const std::vector<Words>& rows);

/// Formats an array of objects as a Markdown table. @param keys  columns; empty: the keys of the first object
std::string markdown_list(const Json& list, Words keys = {});

/// Formats a page with the protocol and every figure of a result. Equal results give equal pages, without
/// date or host name.
std::string markdown_report(const Words& command_line, const Machine& machine, const Json& result);

}  // namespace fieldmark::results
