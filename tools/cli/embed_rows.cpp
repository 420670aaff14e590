#include "cli/embed_rows.h"

#include <fieldmark/core/files.h>

#include <cmath>
#include <limits>
#include <utility>

#include "cli/report.h"

namespace fieldmark::cli {
namespace {

using bench::EmbedRow;

// The figures of a row with their names in the file.
constexpr std::pair<const char*, double EmbedRow::*> kFigures[] = {
    {"view_seconds", &EmbedRow::cache_seconds},
    {"seconds", &EmbedRow::seconds},
    {"accuracy", &EmbedRow::accuracy},
    {"accuracy_p5", &EmbedRow::accuracy_p5},
    {"psnr_foreground", &EmbedRow::psnr_foreground},
    {"closer", &EmbedRow::closer},
    {"farther", &EmbedRow::farther},
    {"extrapolated", &EmbedRow::unseen}};
constexpr std::pair<const char*, double watermark::Embedder::Figures::*> kInTraining[] = {
    {"sign", &watermark::Embedder::Figures::sign},
    {"cell", &watermark::Embedder::Figures::index},
    {"bits_in_training", &watermark::Embedder::Figures::bits}};

double value_of(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

Json json_of(const EmbedRow& row, const std::string& commit) {
  Json j{{"choice", row.variant.choice}, {"setting", row.variant.setting}, {"commit", commit}};
  j.update(embed_figures(row));
  Json curve = Json::array();
  for (const bench::EmbedPoint& p : row.curve)
    curve.push_back({number(p.seconds), number(p.accuracy), number(p.psnr_foreground)});
  j["curve"] = curve;
  return j;
}

EmbedRow row_of(const Json& j) {
  EmbedRow row;
  row.variant.choice = j.at("choice");
  row.variant.setting = j.at("setting");
  row.steps = j.at("steps");
  for (const auto& [name, figure] : kFigures) row.*figure = value_of(j.at(name));
  for (const auto& [name, figure] : kInTraining) row.figures.*figure = value_of(j.at(name));
  for (const Json& p : j.at("curve"))
    row.curve.push_back({value_of(p.at(0)), value_of(p.at(1)), value_of(p.at(2))});
  return row;
}

}  // namespace

Json embed_figures(const EmbedRow& row) {
  Json j;
  for (const auto& [name, figure] : kFigures) j[name] = number(row.*figure);
  j["steps"] = row.steps;
  for (const auto& [name, figure] : kInTraining) j[name] = number(row.figures.*figure);
  return j;
}

EmbedRows::EmbedRows(std::filesystem::path path, Json configuration)
    : path_(std::move(path)), configuration_(std::move(configuration)) {
  if (path_.empty() || !std::filesystem::exists(path_)) return;
  try {
    const Json j = Json::parse(read_text(path_));
    if (j.at("configuration") != configuration_)
      throw IoError(path_.string() + ": configuration: expected " + configuration_.dump() + ", found " +
                    j["configuration"].dump());
    for (const Json& row : j.at("rows")) {
      rows_.push_back(row_of(row));
      commits_.push_back(row.at("commit"));
    }
  } catch (const Json::exception& e) {
    throw IoError(path_.string() + ": expected rows of bench embed, found " + e.what());
  }
}

void EmbedRows::add(const EmbedRow& row) {
  rows_.push_back(row);
  commits_.push_back(machine().commit);
  if (!path_.empty()) write();
}

std::string EmbedRows::commit_of(const EmbedRow& row) const {
  const EmbedRow* known = bench::find_row(rows_, row.variant);
  return known ? commits_[static_cast<std::size_t>(known - rows_.data())] : "";
}

void EmbedRows::write() const {
  Json rows = Json::array();
  for (std::size_t i = 0; i < rows_.size(); ++i) rows.push_back(json_of(rows_[i], commits_[i]));
  write_file_atomically(path_, Json{{"configuration", configuration_}, {"rows", rows}}.dump(1) + "\n");
}

}  // namespace fieldmark::cli
