#include <fieldmark/core/error.h>
#include <fieldmark/tools/results/plan.h>

#include <algorithm>
#include <set>
#include <sstream>

#include "plan_text.h"

namespace fieldmark::results {
namespace {

template <class T>
Words words_of(const T& text) {
  std::istringstream in{std::string(text)};
  Words words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

void replace_all(std::string& text, const std::string& what, const std::string& with) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += with.size())
    text.replace(at, what.size(), with);
}

// Appends lines [begin, end) to `out` with their loops expanded.
void expand(const Words& lines, std::size_t begin, std::size_t end, Words& out) {
  for (std::size_t i = begin; i < end; ++i) {
    if (!lines[i].starts_with("%for ")) {
      out.push_back(lines[i]);
      continue;
    }
    std::size_t close = i;
    for (int depth = 0; close < end; ++close) {
      depth += lines[close].starts_with("%for ") ? 1 : lines[close] == "%end" ? -1 : 0;
      if (depth == 0) break;
    }
    const std::size_t equals = lines[i].find(" = ");
    if (close == end || equals == std::string::npos)
      throw ValueError("[expanded] loop: expected '%for NAME... = VALUE...; ...' and '%end', got '" +
                       lines[i] + "'");
    const Words names = words_of(lines[i].substr(5, equals - 5));
    std::istringstream turns(lines[i].substr(equals + 3));
    for (std::string turn; std::getline(turns, turn, ';');) {
      Words values = words_of(turn);
      if (values.size() != names.size())
        throw ValueError("[expanded] loop: expected " + std::to_string(names.size()) + " values a turn in '" +
                         lines[i] + "', got '" + turn + "'");
      Words body(lines.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                 lines.begin() + static_cast<std::ptrdiff_t>(close));
      for (std::string& line : body)
        for (std::size_t n = 0; n < names.size(); ++n) replace_all(line, "{" + names[n] + "}", values[n]);
      expand(body, 0, body.size(), out);
    }
    i = close;
  }
}

bool is_input(const std::string& word) { return word.starts_with('@') || word.starts_with("scene:"); }

}  // namespace

Words expanded(std::string_view text) {
  Words lines, out;
  std::istringstream in{std::string(text)};
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  expand(lines, 0, lines.size(), out);
  for (std::string& line : out) std::ranges::replace(line, '~', ' ');
  return out;
}

Words PlannedRow::inputs() const {
  Words found;
  std::string before;
  for (const std::string& word : words_of(command)) {
    if (is_input(word) && before != "--out" && std::ranges::find(found, word) == found.end())
      found.push_back(word);
    before = word;
  }
  return found;
}

std::string PlannedRow::output() const {
  const Words words = words_of(command);
  const auto option = std::ranges::find(words, "--out");
  return option == words.end() || option + 1 == words.end() ? "" : *(option + 1);
}

Plan::Plan(std::string_view text) {
  for (const std::string& line : expanded(text)) {
    const Words words = words_of(line);
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::size_t colon = line.find(": ");
    if (words[0] == "scene" && words.size() == 3) {
      scenes_[words[1]] = words[2];
    } else if (words[0] == "kind" && colon != std::string::npos) {
      kinds_[line.substr(5, colon - 5)] = words_of(line.substr(colon + 2));
    } else if (colon != std::string::npos && words.size() > 1) {
      const bool two = words[1] == "bench" && words.size() > 2;
      rows_.push_back({words[0].substr(0, words[0].size() - 1), two ? words[1] + " " + words[2] : words[1],
                       line.substr(line.find(words[1], colon))});
      const PlannedRow& row = rows_.back();
      if (!kinds_.contains(row.kind))
        throw ValueError("[plan] " + row.id + ": kind must be declared, got '" + row.kind + "'");
      for (const std::string& input : row.inputs())
        if (input.starts_with("scene:") ? !scenes_.contains(input.substr(6)) : !producer(input))
          throw ValueError("[plan] " + row.id + ": nothing makes the input '" + input + "' before it");
    } else {
      throw ValueError("[plan] line: expected 'kind', 'scene' or 'ID: COMMAND', got '" + line + "'");
    }
  }
  std::set<std::string> ids;
  for (const PlannedRow& row : rows_)
    if (!ids.insert(row.id).second) throw ValueError("[plan] id must be unique, got '" + row.id + "' again");
}

const Plan& Plan::project() {
  static const Plan plan(kPlan);
  return plan;
}

const PlannedRow* Plan::find(std::string_view id) const {
  const auto row = std::ranges::find(rows_, id, &PlannedRow::id);
  return row == rows_.end() ? nullptr : &*row;
}

const PlannedRow* Plan::producer(std::string_view input) const {
  const auto row = std::ranges::find_if(rows_, [&](const PlannedRow& r) {
    const std::string made = r.output();
    return !made.empty() && (input == made || input.starts_with(made + "/"));
  });
  return row == rows_.end() ? nullptr : &*row;
}

std::string Plan::scene(const std::string& name) const {
  const auto found = scenes_.find(name);
  return found == scenes_.end() ? "" : found->second;
}

std::string Plan::code(const PlannedRow& row) const {
  const auto kind = kinds_.find(row.kind);
  return kind == kinds_.end() ? "" : code_hash(kind->second);
}

}  // namespace fieldmark::results
