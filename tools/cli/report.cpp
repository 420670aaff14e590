#include "cli/report.h"

#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/parallel.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/commit.h"

namespace fieldmark::cli {
namespace {

using Json = nlohmann::ordered_json;
constexpr std::size_t kLongestTable = 200;  // rows; lists of views go on in the JSON

std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  return "unknown";
}

std::string cell(const Json& value) {
  if (value.is_null()) return "-";
  if (value.is_string()) return value.get<std::string>();
  if (!value.is_number_float()) return value.dump();
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value.get<double>());
  return text;
}

bool is_list_of_rows(const Json& value) { return value.is_array() && !value.empty() && value[0].is_object(); }

// One row for each number; nested names are joined with a dot.
void flatten(const std::string& prefix, const Json& value, std::vector<std::vector<std::string>>& rows) {
  if (value.is_object()) {
    const std::string before = prefix.empty() ? "" : prefix + ".";
    for (const auto& [key, inner] : value.items())
      if (!is_list_of_rows(inner)) flatten(before + key, inner, rows);
  } else {
    rows.push_back({prefix, cell(value)});
  }
}

std::string list_table(const Json& list) {
  std::vector<std::string> header;
  for (const auto& [key, value] : list[0].items())
    if (!value.is_structured()) header.push_back(key);
  std::vector<std::vector<std::string>> rows;
  for (const auto& item : list) {
    if (rows.size() == kLongestTable) break;
    auto& row = rows.emplace_back();
    for (const auto& key : header) row.push_back(item.contains(key) ? cell(item[key]) : "-");
  }
  return markdown_table(header, rows);
}

}  // namespace

Machine machine() {
  return {.commit = FIELDMARK_COMMIT,
          .cpu = cpu_model(),
          .isa = isa_name(),
          .compiler = FIELDMARK_COMPILER,
          .threads = threads()};
}

std::string published_command(const std::vector<std::string>& command_line) {
  const char* data = std::getenv("FIELDMARK_DATA");
  std::string text;
  for (const auto& word : command_line) {
    std::string shown = word;
    if (data && *data && word.starts_with(data))
      shown = "$FIELDMARK_DATA" + word.substr(std::string(data).size());
    else if (word.starts_with('/'))
      shown = std::filesystem::path(word).filename().string();
    text += (text.empty() ? "" : " ") + shown;
  }
  return text;
}

std::string markdown_table(const std::vector<std::string>& header,
                           const std::vector<std::vector<std::string>>& rows) {
  std::string text;
  const auto add = [&](const std::vector<std::string>& cells) {
    for (const auto& c : cells) text += "| " + c + " ";
    text += "|\n";
  };
  add(header);
  add(std::vector<std::string>(header.size(), "---"));
  for (const auto& row : rows) add(row);
  return text;
}

std::string markdown_report(const std::vector<std::string>& command_line, const Machine& machine,
                            const Json& results) {
  std::string text = "# " + (command_line.size() > 1 ? command_line[1] : std::string("fieldmark")) +
                     "\n\n```\n" + published_command(command_line) + "\n```\n\n";
  text += markdown_table({"protocol", ""}, {{"commit", machine.commit},
                                            {"CPU", machine.cpu},
                                            {"kernels", "x86-64-" + machine.isa},
                                            {"threads", std::to_string(machine.threads)},
                                            {"compiler", machine.compiler}});
  std::vector<std::vector<std::string>> rows;
  flatten("", results, rows);
  if (!rows.empty()) text += "\n" + markdown_table({"result", ""}, rows);
  if (results.is_object())
    for (const auto& [key, value] : results.items())
      if (is_list_of_rows(value)) text += "\n## " + key + "\n\n" + list_table(value);
  return text;
}

}  // namespace fieldmark::cli
