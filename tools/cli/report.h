#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace fieldmark::cli {

/// What a measured figure depends on besides the command.
struct Machine {
  std::string
      commit;       ///< of the sources, with "+ changes" if they were changed since; "unknown" outside of git
  std::string cpu;  ///< model name
  std::string isa;  ///< "v2", "v3" or "v4": the kernels in use
  std::string compiler;  ///< name, version and flags
  int threads = 1;
};
Machine machine();

/// The command line as it may be published: files below $FIELDMARK_DATA are shown so, other absolute paths by
/// their last part.
std::string published_command(const std::vector<std::string>& command_line);

/// Rows below a header as a Markdown table. Every row has as many cells as the header.
std::string markdown_table(const std::vector<std::string>& header,
                           const std::vector<std::vector<std::string>>& rows);

/// A page with the protocol and every figure of a command's results. Equal results give equal pages: no date,
/// no host.
std::string markdown_report(const std::vector<std::string>& command_line, const Machine& machine,
                            const nlohmann::ordered_json& results);

}  // namespace fieldmark::cli
