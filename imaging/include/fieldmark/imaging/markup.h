#pragma once
#include <string>
#include <string_view>

namespace fieldmark::bench {

/// A text that stands for itself in XML and HTML, between tags as in quoted attributes: & < > " and ' become
/// entities, control characters but tab and line feed the sign for what cannot be shown (U+FFFD).
std::string escaped_markup(std::string_view text);

}  // namespace fieldmark::bench
