#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace fieldmark::cli {

/// Breaks lines between words. A line break in the text stays, and a word longer than the width has a line of
/// its own.
/// @param width  of a line, characters, at least 1
std::string wrapped(const std::string& text, std::size_t width);

/// Help with descriptions wrapped to kWidth columns.
class WrappedHelp : public CLI::Formatter {
 public:
  static constexpr std::size_t kWidth = 120;       ///< columns of a line
  static constexpr std::size_t kDescription = 34;  ///< column at which descriptions begin
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
};

}  // namespace fieldmark::cli
