#include <fieldmark/core/error.h>
#include <fieldmark/tools/results/charts.h>
#include <fieldmark/tools/results/page.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <sstream>

#include "pages_text.h"

namespace fieldmark::results {
namespace {

Words split(const std::string& text, char at) {
  std::istringstream in(text);
  Words parts;
  for (std::string part; std::getline(in, part, at);)
    if (!part.empty()) parts.push_back(part);
  return parts;
}

std::string formatted(const Json& value, const std::string& format) {
  if (!value.is_number() || format.empty()) return shown(value);
  char text[40];
  const double number = value.get<double>();
  if (format == "%")
    std::snprintf(text, sizeof text, "%.2f%%", 100 * number);
  else if (format[0] == 'g')
    std::snprintf(text, sizeof text, "%.*g", std::stoi(format.substr(1)), number);
  else
    std::snprintf(text, sizeof text, "%.*f", std::stoi(format.substr(1)), number);
  return text;
}

class Page {
 public:
  Page(const Rows& rows, const std::function<std::string(const std::string&)>& stale, Pages& files)
      : rows_(rows), stale_(stale), files_(files) {}

  std::string line(const std::string& line) {
    const Words words = split(line, ' ');
    if (line.starts_with("%measured ") && words.size() == 2) {
      hidden_ = row(words[1]) == nullptr;
      return hidden_ ? "Not measured.\n" : "";
    }
    if (line == "%end-measured") {
      hidden_ = false;
      return "";
    }
    if (hidden_) return "";
    if (line.starts_with("%list ") && words.size() > 2)
      return list(joined(words[1]), words[2], {words.begin() + 3, words.end()});
    if (line.starts_with("%chart ") && words.size() == 4) return chart(words[1], words[2], joined(words[3]));
    if (line == "%provenance") return provenance();
    if (line.starts_with('%')) throw ValueError("[render_pages] line: no directive is '" + line + "'");
    std::string text;
    std::size_t at = 0;
    for (std::size_t open; (open = line.find("[[", at)) != std::string::npos;) {
      const std::size_t close = line.find("]]", open);
      if (close == std::string::npos) throw ValueError("[render_pages] line: no ']]' in '" + line + "'");
      text += line.substr(at, open - at) + figure(split(line.substr(open + 2, close - open - 2), ' '));
      at = close + 2;
    }
    return text + line.substr(at) + "\n";
  }

 private:
  const Json* row(const std::string& id) {
    if (std::ranges::find(named_, id) == named_.end()) named_.push_back(id);
    const auto found = rows_.find(id);
    return found == rows_.end() ? nullptr : &found->second;
  }

  std::string figure(const Words& words) {
    if (words.size() < 2) throw ValueError("[render_pages] [[...]]: expected ID PATH [FORMAT]");
    const Json* found = row(words[0]);
    if (words[1] == "status") return !found ? "-" : stale_(words[0]).empty() ? "fresh" : "stale";
    const Json::json_pointer path("/" + words[1]);
    if (!found || !(*found)["result"].contains(path)) return "-";
    return formatted((*found)["result"][path], words.size() > 2 ? words[2] : "");
  }

  // Returns the first available result, with the rows of the others appended to its arrays.
  Json joined(const std::string& ids) {
    Json all;
    for (const std::string& id : split(ids, ',')) {
      const Json* found = row(id);
      if (!found) continue;
      const Json& result = (*found)["result"];
      if (all.is_null()) {
        all = result;
        continue;
      }
      for (auto& [key, value] : all.items())
        if (value.is_array() && result.contains(key))
          value.insert(value.end(), result[key].begin(), result[key].end());
    }
    return all;
  }

  static std::string list(const Json& result, const std::string& key, const Words& columns) {
    if (result.is_null() || result.value(key, Json::array()).empty()) return "Not measured.\n";
    return markdown_list(result[key], columns);
  }

  std::string chart(const std::string& file, const std::string& name, const Json& result) {
    const std::string svg = result.is_null() ? "" : result_chart(name, result);
    if (svg.empty()) return "";
    files_[file] = svg;
    return "![" + file + "](" + file + ")\n";
  }

  std::string provenance() {
    std::vector<Words> table;
    for (const std::string& id : named_) {
      const auto found = rows_.find(id);
      if (found == rows_.end()) continue;
      const Json& r = found->second;
      const std::string why = stale_(id);
      table.push_back({id, "`" + shown(r["command"]) + "`", shown(r["commit"]), shown(r["date"]),
                       shown(r["cpu"]), shown(r["isa"]), shown(r["threads"]), shown(r["compiler"]),
                       formatted(r["seconds"], ".0"), why.empty() ? "fresh" : "stale: " + why});
    }
    return markdown_table(
        {"row", "command", "commit", "date", "CPU", "kernels", "threads", "compiler", "s", "state"}, table);
  }

  const Rows& rows_;
  const std::function<std::string(const std::string&)>& stale_;
  Pages& files_;
  Words named_;
  bool hidden_ = false;  // in lines about a row that is missing
};

}  // namespace

Pages render_pages(std::string_view text, const Rows& rows,
                   const std::function<std::string(const std::string&)>& stale) {
  Pages files;
  std::string name;
  std::optional<Page> page;
  for (const std::string& line : expanded(text)) {
    if (line.starts_with("%page ")) {
      name = line.substr(6);
      files[name] = "";
      page.emplace(rows, stale, files);
    } else if (page) {
      files[name] += page->line(line);
    }
  }
  return files;
}

std::string_view project_pages() { return kPages; }

}  // namespace fieldmark::results
