#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace fieldmark::results {

using Json = nlohmann::ordered_json;
using Words = std::vector<std::string>;

/// Everything that a measured figure depends on besides the command and its inputs.
struct Machine {
  std::string commit;    ///< of the sources, with "+ changes" after a dirty build; "unknown" outside of git
  std::string cpu;       ///< model name
  std::string isa;       ///< "v2", "v3" or "v4": the kernels in use
  std::string compiler;  ///< name, version and flags
  int threads = 1;       ///< of this process
};
Machine machine();

/// SHA-256 of the sources of some rooms at the commit of this build, so that a result expires with its code.
/// @param rooms  folders; one without sources of its own, such as "watermark", stands for all rooms in it
/// @throws ValueError for a folder without sources
std::string code_hash(const Words& rooms);

/// The command line without private paths: files below $FIELDMARK_DATA are shown so, other absolute paths by
/// their last part.
std::string published_command(const Words& command_line);

/// A number or word of a result: six significant digits, "-" for null.
std::string shown(const Json& value);

/// A Markdown table. Every row has as many cells as the header.
std::string markdown_table(const Words& header, const std::vector<Words>& rows);

/// A Markdown table of an array of objects. @param keys  its columns; empty: those of the first object
std::string markdown_list(const Json& list, Words keys = {});

/// A page with the protocol and every figure of a result. Equal results give equal pages: no date, no host.
std::string markdown_report(const Words& command_line, const Machine& machine, const Json& result);

}  // namespace fieldmark::results
