#include "cli/wrapped_help.h"

#include <algorithm>
#include <sstream>

namespace fieldmark::cli {

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

std::string WrappedHelp::make_option_desc(const CLI::Option* option) const {
  return wrapped(CLI::Formatter::make_option_desc(option), kWidth - kDescription);
}

std::string WrappedHelp::make_subcommand(const CLI::App* command) const {
  std::ostringstream out;
  CLI::detail::format_help(out, command->get_display_name(true),
                           wrapped(command->get_description(), kWidth - kDescription), kDescription);
  return out.str();
}

}  // namespace fieldmark::cli
