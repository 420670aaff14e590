#pragma once
#include <fieldmark/tools/results/report.h>

#include <filesystem>
#include <map>
#include <string_view>

namespace fieldmark::results {

/// Expands loops: lines between "%for a b = 1 2; 3 4" and "%end" appear once for a = 1, b = 2 and once for
/// a = 3, b = 4, with {a} and {b} replaced. "~" in a value is a space. Loops may nest.
/// @throws ValueError for a loop without its end, or malformed values
Words expanded(std::string_view text);

/// A row that docs/results should contain.
struct PlannedRow {
  std::string id;       ///< "marks/lego-48": its file below the folder of rows, without ".json"
  std::string kind;     ///< first word of the command; for `bench` and the like, the first two
  std::string command;  ///< "scene:NAME" stands for a data set, "@FILE" for a file in the work folder
  /// Returns the files that the command reads, as written in the command.
  Words inputs() const;
  /// Returns the file or folder that the command creates: the word after --out; empty if there is none.
  std::string output() const;
};

/// The planned rows, the sources that each kind runs, and the data sets by name.
class Plan {
 public:
  /// @param text  lines "kind NAME: ROOM...", "scene NAME FOLDER" and "ID: COMMAND", with the loops of
  /// expanded()
  /// @throws ValueError if a line has none of these forms, or names an undeclared kind or scene
  explicit Plan(std::string_view text);
  /// Returns the plan of this project (tools/results/plan.txt).
  static const Plan& project();

  const std::vector<PlannedRow>& rows() const { return rows_; }
  /// Returns the rooms whose sources decide the rows of each kind.
  const std::map<std::string, Words>& kinds() const { return kinds_; }
  /// Return the row with this id, and the row that creates this file; null if there is none.
  const PlannedRow* find(std::string_view id) const;
  const PlannedRow* producer(std::string_view input) const;
  /// Returns the code_hash() of a row.
  std::string code(const PlannedRow& row) const;
  /// Returns the folder of a data set below FIELDMARK_DATA; empty if it is not declared.
  std::string scene(const std::string& name) const;

 private:
  std::vector<PlannedRow> rows_;
  std::map<std::string, Words> kinds_;
  std::map<std::string, std::string> scenes_;
};

}  // namespace fieldmark::results
