#include <fieldmark/tools/results/report.h>

#include <fieldmark/core/digest.h>
#include <fieldmark/core/error.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "commit.h"

namespace fieldmark::results {
namespace {

constexpr std::size_t kLongestTable = 200;  // rows; longer lists of views are only in the JSON

std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

// Escapes what would end a cell: names of files may hold any character.
std::string in_cell(std::string text) {
  for (std::size_t at = 0; (at = text.find_first_of("|\n", at)) != std::string::npos; at += 2)
    text.replace(at, 1, text[at] == '|' ? "\\|" : "  ");
  return text;
}

bool is_list_of_rows(const Json& value) { return value.is_array() && !value.empty() && value[0].is_object(); }

// Replaces bytes that are not UTF-8, such as those of a file's name, by U+FFFD.
std::string valid_utf8(const std::string& text) {
  return Json::parse(Json(text).dump(-1, ' ', false, Json::error_handler_t::replace)).get<std::string>();
}

// Adds a row per number; nested names are joined with a dot.
void flatten(const std::string& prefix, const Json& value, std::vector<Words>& rows) {
  if (value.is_object()) {
    const std::string before = prefix.empty() ? "" : prefix + ".";
    for (const auto& [key, inner] : value.items())
      if (!is_list_of_rows(inner)) flatten(before + key, inner, rows);
  } else {
    rows.push_back({prefix, shown(value)});
  }
}

}  // namespace

Machine machine() {
  return {.commit = FIELDMARK_COMMIT,
          .cpu = cpu_model(),
          .isa = isa_name(),
          .compiler = FIELDMARK_COMPILER,
          .threads = threads()};
}

std::string code_hash(const Words& rooms) {
  // Returns the lines of the trees that begin with one of the words.
  const auto lines_of = [](const Words& beginnings) {
    std::string lines;
    std::istringstream trees(FIELDMARK_TREES);
    for (std::string line; std::getline(trees, line);)
      if (std::ranges::any_of(beginnings, [&](const std::string& b) { return line.starts_with(b); }))
        lines += line + "\n";
    return lines;
  };
  std::string found;
  for (const std::string& room : rooms) {
    std::string lines = lines_of({room + "/include ", room + "/src "});
    if (lines.empty()) lines = lines_of({room + "/"});
    found += lines;
    if (lines.empty() && *FIELDMARK_TREES)
      throw ValueError("[code_hash] rooms: no sources in '" + room + "'");
  }
  return sha256_hex(found);
}

std::string shown(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return valid_utf8(value.get<std::string>());
  if (!value.is_number_float()) return value.dump(-1, ' ', false, Json::error_handler_t::replace);
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value.get<double>());
  return text;
}

std::string published_command(const Words& command_line) {
  const char* data = std::getenv("FIELDMARK_DATA");
  std::string text;
  for (const auto& word : command_line) {
    std::string public_word = word;
    if (data && *data && word.starts_with(data))
      public_word = "$FIELDMARK_DATA" + word.substr(std::string(data).size());
    else if (word.starts_with('/'))
      public_word = std::filesystem::path(word).filename().string();
    text += (text.empty() ? "" : " ") + valid_utf8(public_word);
  }
  return text;
}

std::string markdown_table(const Words& header, const std::vector<Words>& rows) {
  std::string text;
  const auto add = [&](const Words& cells) {
    for (const auto& c : cells) text += "| " + in_cell(c) + " ";
    text += "|\n";
  };
  add(header);
  add(Words(header.size(), "---"));
  for (const auto& row : rows) add(row);
  return text;
}

std::string markdown_list(const Json& list, Words keys) {
  if (keys.empty())
    for (const auto& [key, value] : list.at(0).items())
      if (!value.is_structured()) keys.push_back(key);
  std::vector<Words> rows;
  for (const Json& item : list) {
    if (rows.size() == kLongestTable) break;
    for (auto& row = rows.emplace_back(); const std::string& key : keys)
      row.push_back(item.contains(key) ? shown(item[key]) : "-");
  }
  std::string text = markdown_table(keys, rows);
  if (list.size() > kLongestTable)
    text += "\nand " + std::to_string(list.size() - kLongestTable) + " more, which the JSON has.\n";
  return text;
}

std::string markdown_report(const Words& command_line, const Machine& machine, const Json& result) {
  std::string text = "# " + (command_line.size() > 1 ? command_line[1] : std::string("fieldmark")) +
                     "\n\n```\n" + published_command(command_line) + "\n```\n\n";
  text += markdown_table({"protocol", ""}, {{"commit", machine.commit},
                                            {"CPU", machine.cpu},
                                            {"kernels", "x86-64-" + machine.isa},
                                            {"threads", std::to_string(machine.threads)},
                                            {"compiler", machine.compiler}});
  std::vector<Words> rows;
  flatten("", result, rows);
  if (!rows.empty()) text += "\n" + markdown_table({"result", ""}, rows);
  if (result.is_object())
    for (const auto& [key, value] : result.items())
      if (is_list_of_rows(value)) text += "\n## " + key + "\n\n" + markdown_list(value);
  return text;
}

}  // namespace fieldmark::results
