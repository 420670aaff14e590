#pragma once
#include <fieldmark/tools/bench/embed_bench.h>

#include <filesystem>
#include <string>
#include <vector>

#include "cli/context.h"

namespace fieldmark::cli {

/// Every figure of a row under its name, null where it is no number.
Json embed_figures(const bench::EmbedRow& row);

/// Rows of `bench embed` in a file, kept as they are measured, so that hours of it survive a stop.
class EmbedRows {
 public:
  /// @param path  empty: rows are kept in memory alone   @param configuration  what rows depend on besides
  /// their variant: a file of another one is refused
  /// @throws IoError if the file is none of EmbedRows or of another configuration
  EmbedRows(std::filesystem::path path, Json configuration);
  /// So far, in the order in which they were added.
  const std::vector<bench::EmbedRow>& rows() const { return rows_; }
  /// Adds a row of the running program and writes the file.
  void add(const bench::EmbedRow& row);
  /// Of the sources with which a row was measured, "" for a row that is not there.
  std::string commit_of(const bench::EmbedRow& row) const;

 private:
  void write() const;
  std::filesystem::path path_;
  Json configuration_;
  std::vector<bench::EmbedRow> rows_;
  std::vector<std::string> commits_;  // of rows_
};

}  // namespace fieldmark::cli
