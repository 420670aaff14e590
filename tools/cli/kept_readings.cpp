#include "cli/kept_readings.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/isa.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <fieldmark/tools/results/report.h>
#include "cli/cli.h"

namespace fieldmark::cli {
namespace {

using watermark::ReadingKind;

Json line_of(const ImageEvidence& read) {
  return {{"sha256", read.sha256},       {"detection", watermark::reading_name(read.reading)},
          {"agreement", read.agreement},  // NaN becomes null
          {"width", read.width},         {"height", read.height},
          {"cells", read.cells}};
}

ImageEvidence evidence_of(const Json& line, Index cells) {
  ImageEvidence read;
  read.sha256 = line.at("sha256").get<std::string>();
  const auto kind = line.at("detection").get<std::string>();
  read.reading = kind == reading_name(ReadingKind::informed) ? ReadingKind::informed : ReadingKind::blind;
  if (!line.at("agreement").is_null()) read.agreement = line["agreement"].get<double>();
  read.width = line.at("width").get<Index>();
  read.height = line.at("height").get<Index>();
  read.cells = line.at("cells").get<std::vector<double>>();
  if (std::ssize(read.cells) != cells)
    throw ValueError("it has " + std::to_string(read.cells.size()) + " cells, the owner " +
                     std::to_string(cells));
  return read;
}

// Returns a discarded value if the line is not JSON.
Json parsed(const std::string& line) { return Json::parse(line, nullptr, false); }

Json header_of(const std::string& owner_sha256, const std::string& detection) {
  return {{"readings", 1},
          {"owner_sha256", owner_sha256},
          {"detection", detection},
          {"isa", isa_name()},
          {"commit", results::machine().commit}};
}

void check_header(const std::string& file, const Json& found, const Json& wanted) {
  if (!found.is_object() || found.value("readings", Json()) != wanted["readings"])
    throw IoError(file +
                  ": expected readings of images as --readings writes them, got another file; name a "
                  "new one");
  for (const char* key : {"owner_sha256", "detection", "isa", "commit"})
    if (found.value(key, Json()) != wanted[key])
      throw UsageError("--readings: " + file + " has readings with " + key + " " +
                       found.value(key, Json()).dump() + ", this run has " + wanted[key].dump() +
                       "; name another file");
}

}  // namespace

KeptReadings::KeptReadings(const std::filesystem::path& file, const std::string& owner_sha256,
                           const std::string& detection, Index cells)
    : file_(file) {
  const Json wanted = header_of(owner_sha256, detection);
  const std::string text = std::filesystem::exists(file) ? read_text(file) : "";
  if (text.empty()) {
    const bool made_here = !std::filesystem::exists(file);
    try {
      append(wanted.dump());
    } catch (const IoError&) {
      std::error_code ignored;
      if (made_here) std::filesystem::remove(file, ignored);
      throw;
    }
    return;
  }
  std::istringstream whole(text.substr(0, text.rfind('\n') + 1));
  std::string line;
  check_header(file.string(), std::getline(whole, line) ? parsed(line) : Json(), wanted);
  for (int number = 2; std::getline(whole, line); ++number) try {
      ImageEvidence read = evidence_of(parsed(line), cells);
      readings_[read.sha256] = std::move(read);
    } catch (const std::exception& e) {
      throw IoError(file.string() + ", line " + std::to_string(number) +
                    ": expected the reading of an image, got something else (" + e.what() + ")");
    }
  if (text.back() != '\n') std::filesystem::resize_file(file, text.rfind('\n') + 1);
  append("");  // checks that the file is writable before the work begins
}

std::optional<ImageEvidence> KeptReadings::find(const std::string& sha256) const {
  const auto found = readings_.find(sha256);
  if (found == readings_.end()) return {};
  return found->second;
}

void KeptReadings::add(const ImageEvidence& read) {
  append(line_of(read).dump());
  readings_[read.sha256] = read;
}

void KeptReadings::append(const std::string& line) const {
  std::ofstream out(file_, std::ios::binary | std::ios::app);
  if (!line.empty()) out << line << '\n';
  out.flush();
  if (!out) throw IoError(file_.string() + ": cannot be written");
}

}  // namespace fieldmark::cli
