#include <fieldmark/imaging/markup.h>

namespace fieldmark::bench {

std::string escaped_markup(std::string_view text) {
  std::string out;
  for (char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else if (c == '\'')
      out += "&#39;";
    else if (static_cast<unsigned char>(c) < 0x20 && c != '\t' && c != '\n')
      out += "\xef\xbf\xbd";
    else
      out += c;
  }
  return out;
}

}  // namespace fieldmark::bench
