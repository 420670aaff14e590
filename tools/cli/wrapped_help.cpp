#include "cli/wrapped_help.h"

#include <algorithm>

namespace fieldmark::cli {
namespace {

// Returns a name with its description beside it, or below a name that is too long.
std::string columns(const std::string& name, const std::string& description) {
  constexpr std::size_t kColumn = WrappedHelp::kDescription;
  const std::string indent(kColumn, ' ');
  std::string out = "  " + name;
  if (description.empty()) return out + "\n";
  out += out.size() < kColumn ? indent.substr(out.size()) : "\n" + indent;
  for (const char c : wrapped(description, WrappedHelp::kWidth - kColumn)) {
    out += c;
    if (c == '\n') out += indent;
  }
  return out + "\n";
}

}  // namespace

std::string wrapped(const std::string& text, std::size_t width) {
  std::string out;
  std::size_t begin = 0;  // of the line
  while (true) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    if (end - begin <= width) {
      out.append(text, begin, end - begin);
      if (end == text.size()) return out;
      begin = end + 1;
    } else {
      std::size_t space = text.rfind(' ', begin + width);
      if (space == std::string::npos || space <= begin) space = std::min(text.find(' ', begin), end);
      out.append(text, begin, space - begin);
      if (space == text.size()) return out;
      begin = space + 1;
    }
    out += '\n';
  }
}

std::string WrappedHelp::make_option(const CLI::Option* option, bool is_positional) const {
  return columns(make_option_name(option, is_positional) + make_option_opts(option),
                 make_option_desc(option));
}

std::string WrappedHelp::make_subcommand(const CLI::App* command) const {
  return columns(command->get_display_name(true), command->get_description());
}

}  // namespace fieldmark::cli
