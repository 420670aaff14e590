#include <fieldmark/tools/results/paper_figures.h>

#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/baselines/published.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/imaging/line_chart.h>
#include <fieldmark/imaging/scatter_chart.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <fieldmark/tools/results/sheet.h>

#include "paper_tables.h"

namespace fieldmark::results {
namespace {

using baselines::Cell;
using bench::LineSeries;

constexpr double kChance = 45, kAll = 100;  // %, of the accuracy axis
constexpr Index kBits = 16;                 // of all figures except that of lengths

struct Kind {
  const char *name, *axis;
  double none;  // severity that changes nothing
};
constexpr std::array<Kind, 4> kKinds{{{"noise", "standard deviation, images in [0, 1]", 0},
                                      {"rotation", "largest angle, degrees", 0},
                                      {"scale", "size of the image, as a part", 1},
                                      {"blur", "sigma, pixels", 0}}};

// Returns the cells without those that differ from an earlier one in the seed alone.
std::vector<Cell> one_of_seeds(const std::vector<Cell>& cells) {
  std::vector<Cell> kept;
  for (const Cell& c : cells)
    if (std::ranges::none_of(kept, [&](Cell other) {
          other.name.seed = c.name.seed;
          return other.name == c.name;
        }))
      kept.push_back(c);
  return kept;
}

// Returns the cells that most figures show, few enough to tell their lines apart: those of the scene with
// most cells, on the hash field. The page's tables have the others.
std::vector<Cell> drawn_cells(const std::vector<Cell>& cells) {
  std::map<std::string, int> count;
  for (const Cell& c : cells) ++count[c.name.scene];
  const auto most = std::max_element(count.begin(), count.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<Cell> drawn;
  for (const Cell& c : cells)
    if (c.name.scene == most->first && c.name.field == "hash") drawn.push_back(c);
  return drawn;
}

// Returns the line of a name; creates it if needed.
LineSeries& line_of(std::vector<LineSeries>& lines, const std::string& name, bool dashed = false) {
  const auto found = std::find_if(lines.begin(), lines.end(), [&](const auto& l) { return l.name == name; });
  if (found != lines.end()) return *found;
  lines.push_back({name, {}, dashed});
  return lines.back();
}

// Returns a line for each system measured at two lengths or more.
std::vector<LineSeries> lines_of_lengths(const std::vector<Cell>& cells) {
  std::vector<LineSeries> lines;
  for (const auto& system : baselines::paper_systems())
    for (const Cell& c : cells)
      if (c.name.system == system.name)
        line_of(lines, system.title)
            .points.push_back({static_cast<double>(c.name.bits), 100 * c.bit_accuracy});
  std::erase_if(lines, [](const LineSeries& line) {
    return std::ranges::all_of(line.points, [&](const auto& p) { return p.x == line.points.front().x; });
  });
  for (const auto& system : baselines::paper_systems())
    for (const int bits : {4, 8, 16, 32, 48})
      if (const auto value = baselines::published("bits", system.name, std::to_string(bits)))
        line_of(lines, system.title + ", published", true)
            .points.push_back({static_cast<double>(bits), *value});
  return lines;
}

std::string with_steps(const std::string& title, const Cell& c) {
  return title + ", " + std::to_string(c.steps) + " steps";
}

std::vector<LineSeries> lines_of_severity(const std::vector<Cell>& cells, const Kind& kind) {
  std::vector<LineSeries> lines;
  const std::string prefix = std::string(kind.name) + "_";
  for (const auto& system : baselines::paper_systems())
    for (const Cell& c : cells) {
      if (c.name.system != system.name || c.name.bits != kBits || system.ablation) continue;
      LineSeries points;
      for (const auto& [name, value] : c.under)
        if (name.starts_with(prefix) && name.find(',') == std::string::npos)
          points.points.push_back({std::strtod(name.c_str() + prefix.size(), nullptr), 100 * value});
      if (points.points.empty()) continue;
      LineSeries& line = line_of(lines, with_steps(system.title, c));
      line.points.push_back({kind.none, 100 * c.bit_accuracy});
      line.points.insert(line.points.end(), points.points.begin(), points.points.end());
    }
  return lines;
}

LineSeries curve_of(const Cell& c, const std::string& name) {
  LineSeries line{name, {}, false};
  for (const auto& p : kept_curve(c)) line.points.push_back({p.seconds, 100 * p.figure});
  return line;
}

// Returns the curves of the systems, or of the full models and their ablations.
std::vector<LineSeries> learning_curves(const std::vector<Cell>& cells, bool ablation) {
  std::vector<LineSeries> lines;
  for (const auto& system : baselines::paper_systems()) {
    const bool whole = system.name == "ours" || system.name == "copyrnerf_paper";
    if (ablation ? !(system.ablation || whole) : system.ablation) continue;
    for (const Cell& c : cells) {
      if (c.name.system != system.name || c.name.bits != kBits) continue;
      if (marks_training_images(c)) continue;
      lines.push_back(
          curve_of(c, std::isfinite(c.own_2d_accuracy) ? system.title + ", its 2-D network" : system.title));
    }
  }
  return lines;
}

// Names all of a cell but its system and seed.
std::string place_of(const Cell& c) {
  return with_steps(c.name.scene + ", " + c.name.field + " field, " + std::to_string(c.name.bits) + " bits",
                    c);
}

// Returns the curves of preset paper for every scene, field and length.
std::vector<LineSeries> paper_curves(const std::vector<Cell>& cells) {
  std::vector<LineSeries> lines;
  for (const Cell& c : cells)
    if (c.name.system == "copyrnerf_paper") lines.push_back(curve_of(c, place_of(c)));
  return lines;
}

// Returns the curve of every cell of a longer budget.
std::vector<LineSeries> longer_curves(const std::vector<Cell>& cells) {
  std::vector<LineSeries> lines;
  for (const Cell& c : cells)
    lines.push_back(curve_of(c, baselines::paper_system(c.name.system).title + ", " + place_of(c)));
  return lines;
}

// Returns a point for each system: what it reads, and how far its renders are from the unmarked ones.
std::vector<bench::ScatterPoint> points_of_psnr(const std::vector<Cell>& cells) {
  std::vector<bench::ScatterPoint> points;
  for (const auto& system : baselines::paper_systems())
    for (const Cell& c : cells)
      if (c.name.system == system.name && c.name.bits == kBits && !system.ablation &&
          std::isfinite(c.psnr_base) && std::isfinite(c.bit_accuracy))
        points.push_back({.x = c.psnr_base,
                          .y = 100 * c.bit_accuracy,
                          .series = "16 bits",
                          .label = with_steps(system.title, c)});
  return points;
}

bool is_drawn(const std::vector<LineSeries>& lines) {
  return std::any_of(lines.begin(), lines.end(), [](const LineSeries& l) {
    return std::any_of(l.points.begin(), l.points.end(),
                       [](const auto& p) { return std::isfinite(p.x) && std::isfinite(p.y); });
  });
}

}  // namespace

std::map<std::string, std::string> paper_figures(const PaperCells& measured) {
  const std::vector<Cell> all = one_of_seeds(measured.tables), cells = drawn_cells(all);
  std::string scene;
  if (!cells.empty()) scene.append(", ").append(cells.front().name.scene);
  std::map<std::string, std::string> figures;
  const auto add = [&](const std::string& file, const bench::ScatterText& text,
                       const std::vector<LineSeries>& lines) {
    if (is_drawn(lines)) figures[file] = bench::line_chart(text, lines, kChance, kAll);
  };
  add("paper_bits.svg",
      {"Bit accuracy of one view against the message's length" + scene, "bits", "bits right, %"},
      lines_of_lengths(cells));
  for (const Kind& kind : kKinds)
    add(std::string("paper_") + kind.name + ".svg",
        {std::string("Bit accuracy of one view, 16 bits, under ") + kind.name + scene, kind.axis,
         "bits right, %"},
        lines_of_severity(cells, kind));
  for (const bool ablation : {false, true})
    add(ablation ? "paper_learning_ablation.svg" : "paper_learning.svg",
        {"Bits right in training, 16 bits" + scene, "seconds of training", "bits right, %"},
        learning_curves(cells, ablation));
  add("paper_learning_preset.svg",
      {"Bits right in training, CopyRNeRF, preset paper", "seconds of training", "bits right, %"},
      paper_curves(all));
  add("paper_learning_longer.svg",
      {"Bits right in training, longer budgets", "seconds of training", "bits right, %"},
      longer_curves(one_of_seeds(measured.longer)));
  if (const auto points = points_of_psnr(cells); !points.empty())
    figures["paper_psnr.svg"] =
        bench::scatter_chart({.title = "Bit accuracy of one view against PSNR, 16 bits" + scene,
                              .x = "PSNR to the unmarked render, dB, logarithmic axis",
                              .y = "bits right, %",
                              .y_most = kAll},
                             points);
  return figures;
}

const std::vector<PaperSheet>& paper_sheets() {
  static const std::vector<PaperSheet> sheets = [] {
    std::vector<std::string> systems, ablations;
    for (const auto& s : baselines::paper_systems()) (s.ablation ? ablations : systems).push_back(s.name);
    return std::vector<PaperSheet>{
        {.name = "paper_images.png", .systems = systems},
        {.name = "paper_ablation.png", .systems = ablations},
        {.name = "paper_residual.png", .systems = {"nerf_hidden", "nerf_mbrs"}, .gain = 30}};
  }();
  return sheets;
}

std::vector<std::string> write_paper_sheet(const PaperSheet& sheet, const std::vector<Cell>& cells,
                                           const std::filesystem::path& folder,
                                           const std::filesystem::path& file) {
  std::vector<ImagePair> pairs;
  std::vector<std::string> stems;
  for (const Cell& c : cells) {
    const std::string view_image = cell_path(folder, c.name).string() + ".png";
    if (c.name.bits != kBits || !std::filesystem::exists(view_image) ||
        std::find(sheet.systems.begin(), sheet.systems.end(), c.name.system) == sheet.systems.end())
      continue;
    const Tensor<float> both = read_image(view_image);
    const Index h = both.shape[0], w = both.shape[1] / 2, channels = both.shape[2];
    ImagePair pair{Tensor<float>({h, w, channels}), Tensor<float>({h, w, channels})};
    for (Index y = 0; y < h; ++y) {
      const auto row = both.data.begin() + 2 * y * w * channels;
      std::copy_n(row, w * channels, pair.first.data.begin() + y * w * channels);
      std::copy_n(row + w * channels, w * channels, pair.second.data.begin() + y * w * channels);
    }
    pairs.push_back(std::move(pair));
    stems.push_back(c.name.stem());
  }
  if (!pairs.empty()) write_png(file, comparison_sheet(pairs, sheet.gain));
  return stems;
}

}  // namespace fieldmark::results
