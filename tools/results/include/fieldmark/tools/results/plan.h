#pragma once
#include <fieldmark/tools/results/report.h>

#include <filesystem>
#include <map>
#include <string_view>

namespace fieldmark::results {

/// Expands loops: lines between "%for a b = 1 2; 3 4" and "%end" come once for a = 1, b = 2 and once for a =
/// 3, b = 4, with {a} and {b} replaced. "~" in a value is a space. Loops nest. @throws ValueError for a loop
/// without its end, or bad values
Words expanded(std::string_view text);

/// A row that docs/results should have.
struct PlannedRow {
  std::string id;       ///< "marks/lego-48": its file below the folder of rows, without ".json"
  std::string kind;     ///< the command's first word, for `bench` and its like the first two
  std::string command;  ///< "scene:NAME" stands for a data set, "@FILE" for a file of the work folder
  /// The files that the command reads, as its words name them.
  Words inputs() const;
  /// The file or folder that the command makes: the word after --out; empty if there is none.
  std::string output() const;
};

/// The rows that there should be, the sources that each kind runs, and the data sets by name.
class Plan {
 public:
  /// @param text  lines "kind NAME: ROOM...", "scene NAME FOLDER" and "ID: COMMAND", with the loops of
  /// expanded()
  /// @throws ValueError if a line is none of these or names a kind or a scene that is not declared
  explicit Plan(std::string_view text);
  /// The plan of this project (tools/results/plan.txt).
  static const Plan& project();

  const std::vector<PlannedRow>& rows() const { return rows_; }
  /// Null where there is none of this name, or none that makes the file.
  const PlannedRow* find(std::string_view id) const;
  const PlannedRow* producer(std::string_view input) const;
  /// See code_hash().
  std::string code(const PlannedRow& row) const;
  /// Folder of a data set below FIELDMARK_DATA; empty if it is not declared.
  std::string scene(const std::string& name) const;

 private:
  std::vector<PlannedRow> rows_;
  std::map<std::string, Words> kinds_;
  std::map<std::string, std::string> scenes_;
};

}  // namespace fieldmark::results
