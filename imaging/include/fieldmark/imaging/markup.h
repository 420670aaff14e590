#pragma once
#include <string>
#include <string_view>

namespace fieldmark::bench {

/// Escapes text for XML and HTML, between tags and in quoted attributes: & < > " and ' become entities;
/// control characters except tab and line feed become U+FFFD, the replacement character.
std::string escaped_markup(std::string_view text);

}  // namespace fieldmark::bench
