#include <fieldmark/baselines/cell.h>
#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <system_error>

namespace fieldmark::baselines {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

double read_number(const Json& j) { return j.is_null() ? std::nan("") : j.get<double>(); }

Json numbers(const std::map<std::string, double>& values) {
  Json j = Json::object();
  for (const auto& [name, value] : values) j[name] = number(value);
  return j;
}

std::map<std::string, double> read_numbers(const Json& j) {
  std::map<std::string, double> values;
  for (const auto& [name, value] : j.items()) values[name] = read_number(value);
  return values;
}

constexpr std::string_view kLearning = "learning ";  // of names in Cell::more
constexpr std::size_t kCurvePoints = 50;

}  // namespace

void keep_curve(Cell& cell, std::string_view curve) {
  std::vector<CurvePoint> points;
  std::istringstream lines{std::string(curve)};
  std::string line;
  std::getline(lines, line);  // the header
  while (std::getline(lines, line)) {
    CurvePoint p;
    if (std::sscanf(line.c_str(), "%lf,%lf,%lf", &p.seconds, &p.steps, &p.figure) != 3)
      throw IoError(cell.name.stem() + ": expected a point of its course, found '" + line + "'");
    points.push_back(p);
  }
  const std::size_t kept = std::min(points.size(), kCurvePoints);
  for (std::size_t k = 0; k < kept; ++k) {
    const CurvePoint& p = points[(k + 1) * points.size() / kept - 1];
    char name[64];
    std::snprintf(name, sizeof name, "%s%.1f %.0f", kLearning.data(), p.seconds, p.steps);
    cell.more[name] = p.figure;
  }
}

std::vector<CurvePoint> kept_curve(const Cell& cell) {
  std::vector<CurvePoint> points;
  for (const auto& [name, figure] : cell.more) {
    CurvePoint p{.figure = figure};
    if (name.starts_with(kLearning) &&
        std::sscanf(name.c_str() + kLearning.size(), "%lf %lf", &p.seconds, &p.steps) == 2)
      points.push_back(p);
  }
  std::sort(points.begin(), points.end(), [](const CurvePoint& a, const CurvePoint& b) {
    return a.seconds != b.seconds ? a.seconds < b.seconds : a.steps < b.steps;
  });
  return points;
}

std::string CellName::stem() const {
  return system + "-" + scene + "-" + field + "-" + std::to_string(bits) + "-" + std::to_string(seed);
}

std::string format_cell(const Cell& c) {
  const Json j{{"system", c.name.system},
               {"scene", c.name.scene},
               {"field", c.name.field},
               {"bits", c.name.bits},
               {"seed", c.name.seed},
               {"steps", c.steps},
               {"seconds", number(c.seconds)},
               {"bit_accuracy", number(c.bit_accuracy)},
               {"spread", number(c.spread)},
               {"own_2d_accuracy", number(c.own_2d_accuracy)},
               {"psnr_base", number(c.psnr_base)},
               {"psnr_base_foreground", number(c.psnr_base_foreground)},
               {"psnr_gt", number(c.psnr_gt)},
               {"ssim", number(c.ssim)},
               {"lpips", number(c.lpips)},
               {"distorted", numbers(c.under)},
               {"commit", c.commit},
               {"more", numbers(c.more)}};
  return j.dump(2) + "\n";
}

Cell parse_cell(std::string_view text, std::string_view place) {
  try {
    const Json whole = Json::parse(text);
    const Json& j = whole.contains("result") ? whole["result"] : whole;  // a row, or the cell alone
    return {.name = {j.at("system"), j.at("scene"), j.at("field"), j.at("bits"), j.at("seed")},
            .steps = j.at("steps"),
            .seconds = read_number(j.at("seconds")),
            .bit_accuracy = read_number(j.at("bit_accuracy")),
            .spread = read_number(j.at("spread")),
            .own_2d_accuracy = read_number(j.at("own_2d_accuracy")),
            .psnr_base = read_number(j.at("psnr_base")),
            .psnr_base_foreground = read_number(j.at("psnr_base_foreground")),
            .psnr_gt = read_number(j.at("psnr_gt")),
            .ssim = read_number(j.at("ssim")),
            .lpips = read_number(j.at("lpips")),
            .under = read_numbers(j.at("distorted")),
            .commit = j.at("commit"),
            .more = read_numbers(j.at("more"))};
  } catch (const Json::exception& e) {
    throw IoError(std::string(place) + ": expected a cell of `fieldmark reproduce`, found " + e.what());
  }
}

std::filesystem::path cell_path(const std::filesystem::path& folder, const CellName& name) {
  return folder / name.stem();
}

void save_cell(const std::filesystem::path& folder, const Cell& cell) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw IoError(folder.string() + ": cannot make the folder: " + failed.message());
  write_file_atomically(cell_path(folder, cell.name).string() + ".json", format_cell(cell));
}

std::vector<Cell> load_cells(const std::filesystem::path& folder) {
  std::vector<Cell> cells;
  if (!std::filesystem::is_directory(folder)) return cells;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".json") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    cells.push_back(parse_cell(read_text(file), file.string()));
    if (cells.back().name.stem() != file.stem())
      throw IoError(file.string() + ": expected the cell of this name, found that of " +
                    cells.back().name.stem());
  }
  return cells;
}

}  // namespace fieldmark::baselines
