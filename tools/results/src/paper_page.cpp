#include <fieldmark/tools/results/paper_page.h>

#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/baselines/published.h>
#include <fieldmark/core/files.h>
#include <fieldmark/tools/results/paper_figures.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <set>

#include <fieldmark/tools/results/report.h>

namespace fieldmark::results {
namespace {

using baselines::Cell;
using baselines::published;
using Row = Words;

std::string fixed(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

std::string percent(double share) { return fixed(100 * share, 2); }

std::string of_paper(const char* table, const std::string& system, const std::string& column,
                     int digits = 2) {
  const auto value = published(table, system, column);
  return value ? fixed(*value, digits) : "-";
}

// Mean of a figure over the seeds of a cell.
double mean(const std::vector<const Cell*>& cells, double Cell::*member) {
  double sum = 0;
  for (const Cell* c : cells) sum += c->*member;
  return cells.empty() ? std::nan("") : sum / static_cast<double>(cells.size());
}

double mean_under(const std::vector<const Cell*>& cells, const std::string& name) {
  double sum = 0, count = 0;
  for (const Cell* c : cells)
    if (const auto found = c->under.find(name); found != c->under.end()) sum += found->second, count += 1;
  return count > 0 ? sum / count : std::nan("");
}

double mean_more(const std::vector<const Cell*>& cells, const std::string& name) {
  double sum = 0;
  for (const Cell* c : cells) sum += c->more.contains(name) ? c->more.at(name) : std::nan("");
  return cells.empty() ? std::nan("") : sum / static_cast<double>(cells.size());
}

// Cells that differ in their seeds alone.
struct Group {
  std::string system, title, scene, field;
  Index bits;
  std::vector<const Cell*> cells;
};

// In the order of paper_systems(), then as the cells come.
std::vector<Group> groups_of(const std::vector<Cell>& cells) {
  std::vector<Group> groups;
  for (const auto& system : baselines::paper_systems())
    for (const Cell& c : cells) {
      if (c.name.system != system.name) continue;
      auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
        return g.system == c.name.system && g.scene == c.name.scene && g.field == c.name.field &&
               g.bits == c.name.bits;
      });
      if (found == groups.end())
        found = groups.insert(groups.end(),
                              {c.name.system, system.title, c.name.scene, c.name.field, c.name.bits, {}});
      found->cells.push_back(&c);
    }
  return groups;
}

std::string accuracy_of(const Group& g) {
  std::string text =
      percent(mean(g.cells, &Cell::bit_accuracy)) + " ± " + percent(mean(g.cells, &Cell::spread));
  return g.cells.size() > 1 ? text + " (" + std::to_string(g.cells.size()) + " seeds)" : text;
}

const std::vector<Index> kLengths{4, 8, 16, 32, 48};

std::string bits_table(const std::vector<Group>& groups) {
  Row header{"system", "scene", "field"};
  for (const Index n : kLengths) header.push_back(std::to_string(n) + " bits (published)");
  std::vector<Row> rows;
  std::set<std::string> seen;
  for (const Group& g : groups) {
    if (!seen.insert(g.system + "/" + g.scene + "/" + g.field).second) continue;
    Row row{g.title, g.scene, g.field};
    for (const Index n : kLengths) {
      const auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& other) {
        return other.system == g.system && other.scene == g.scene && other.field == g.field &&
               other.bits == n;
      });
      row.push_back((found == groups.end() ? "-" : accuracy_of(*found)) + " (" +
                    of_paper("bits", g.system, std::to_string(n)) + ")");
    }
    rows.push_back(row);
  }
  return markdown_table(header, rows);
}

std::string quality_table(const std::vector<Group>& groups) {
  std::vector<Row> rows;
  for (const Group& g : groups) {
    if (g.bits != 16) continue;
    const auto both = [&](double ours, const char* column, int digits) {
      return fixed(ours, digits) + " (" + of_paper("quality", g.system, column, digits) + ")";
    };
    rows.push_back(
        {g.title, g.scene, g.field, accuracy_of(g) + " (" + of_paper("quality", g.system, "accuracy") + ")",
         percent(mean(g.cells, &Cell::own_2d_accuracy)), fixed(mean(g.cells, &Cell::psnr_base), 2),
         fixed(mean(g.cells, &Cell::psnr_base_foreground), 2), fixed(mean_more(g.cells, "ssim_base"), 3),
         fixed(mean_more(g.cells, "lpips_base"), 3), both(mean(g.cells, &Cell::psnr_gt), "psnr", 2),
         fixed(mean_more(g.cells, "psnr_gt_unmarked"), 2), both(mean(g.cells, &Cell::ssim), "ssim", 3),
         both(mean(g.cells, &Cell::lpips), "lpips", 3)});
  }
  return markdown_table(
      {"system", "scene", "field", "bits right, % (published)", "2-D network on its own images, %",
       "PSNR to the unmarked render", "the same on the foreground", "SSIM to it", "LPIPS to it",
       "PSNR to ground truth (published)", "of the unmarked field", "SSIM to ground truth (published)",
       "LPIPS to ground truth (published)"},
      rows);
}

// Names of distortions in order of kind, then severity.
struct Severity {
  std::string name, kind;
  double amount;
};

std::vector<Severity> severities(const std::vector<Group>& groups) {
  std::vector<Severity> found;
  for (const Group& g : groups)
    for (const Cell* c : g.cells)
      for (const auto& [name, value] : c->under) {
        const std::size_t line = name.find('_');
        if (line == std::string::npos || name.find(',') != std::string::npos) continue;
        const std::string kind = name.substr(0, line);
        if (kind != "noise" && kind != "rotation" && kind != "scale" && kind != "blur") continue;
        if (std::none_of(found.begin(), found.end(),
                         [&, n = name](const Severity& s) { return s.name == n; }))
          found.push_back({name, kind, std::strtod(name.c_str() + line + 1, nullptr)});
      }
  std::sort(found.begin(), found.end(), [](const Severity& a, const Severity& b) {
    return a.kind != b.kind ? a.kind < b.kind : a.amount < b.amount;
  });
  return found;
}

std::string distortion_table(const std::vector<Group>& groups) {
  const auto under = severities(groups);
  Row header{"system", "scene", "field", "none (published)"};
  for (const Severity& s : under) header.push_back(s.name + " (published)");
  std::vector<Row> rows;
  for (const Group& g : groups) {
    if (g.bits != 16 || g.cells.front()->under.empty()) continue;
    Row row{
        g.title, g.scene, g.field,
        percent(mean(g.cells, &Cell::bit_accuracy)) + " (" + of_paper("distortion", g.system, "none") + ")"};
    for (const Severity& s : under)
      row.push_back(percent(mean_under(g.cells, s.name)) + " (" + of_paper("distortion", g.system, s.name) +
                    ")");
    rows.push_back(row);
  }
  return markdown_table(header, rows);
}

std::string ablation_table(const std::vector<Group>& groups) {
  std::vector<Row> rows;
  for (const Group& g : groups) {
    const bool ablated = g.system.starts_with("copyrnerf_") || g.system == "drs" ||
                         g.system.starts_with("without_") || g.system.starts_with("ours");
    if (g.bits != 16 || g.field != "hash" || !ablated) continue;
    const auto both = [&](double ours, const char* column, int digits) {
      return fixed(ours, digits) + " (" + of_paper("ablation", g.system, column, digits) + ")";
    };
    rows.push_back(
        {g.title, g.scene, accuracy_of(g) + " (" + of_paper("ablation", g.system, "accuracy") + ")",
         fixed(mean(g.cells, &Cell::psnr_base), 2), both(mean(g.cells, &Cell::psnr_gt), "psnr", 2),
         both(mean(g.cells, &Cell::ssim), "ssim", 3), both(mean(g.cells, &Cell::lpips), "lpips", 3)});
  }
  return markdown_table({"system", "scene", "bits right, % (published)", "PSNR to the unmarked render",
                         "PSNR to ground truth (published)", "SSIM to ground truth (published)",
                         "LPIPS to ground truth (published)"},
                        rows);
}

// One column for each name of `under` that begins with the prefix, beside the published figures of a table.
std::string named_table(const std::vector<Group>& groups, const char* table, const std::string& prefix) {
  std::set<std::string> names;
  for (const Group& g : groups)
    for (const Cell* c : g.cells)
      for (const auto& [name, value] : c->under)
        if (name.starts_with(prefix)) names.insert(name);
  if (names.empty()) return "No cell has been measured.\n";
  Row header{"system", "scene", "field", "bits", "as trained"};
  for (const auto& name : names) header.push_back(name + " (published)");
  std::vector<Row> rows;
  for (const Group& g : groups) {
    Row row{g.title, g.scene, g.field, std::to_string(g.bits), percent(mean(g.cells, &Cell::bit_accuracy))};
    bool any = false;
    for (const auto& name : names) {
      const double value = mean_under(g.cells, name);
      any = any || std::isfinite(value);
      const std::string column = prefix == "sampling_" ? name.substr(prefix.size()) : name;
      row.push_back(percent(value) + " (" + of_paper(table, g.system, column) + ")");
    }
    if (any) rows.push_back(row);
  }
  return markdown_table(header, rows);
}

std::string order_of_rows(const std::vector<Group>& groups) {
  std::string text;
  for (const Group& a : groups)
    for (const Group& b : groups) {
      const auto pa = published("quality", a.system, "accuracy"),
                 pb = published("quality", b.system, "accuracy");
      if (!pa || !pb || *pa <= *pb || a.bits != 16 || b.bits != 16 || a.scene != b.scene ||
          a.field != b.field)
        continue;
      const double ours_a = mean(a.cells, &Cell::bit_accuracy), ours_b = mean(b.cells, &Cell::bit_accuracy);
      if (ours_a >= ours_b) continue;
      text += "- " + a.scene + ", " + a.field + " field: " + a.title + " (" + percent(ours_a) +
              "%) stands below " + b.title + " (" + percent(ours_b) + "%); the paper has " + fixed(*pa, 2) +
              "% above " + fixed(*pb, 2) + "%\n";
    }
  return text.empty() ? "No two systems with figures in both stand in another order than the paper's.\n"
                      : text;
}

std::string protocol_table(const std::vector<Cell>& cells) {
  std::vector<Row> rows;
  double seconds = 0;
  for (const Cell& c : cells) {
    const auto more = [&](const char* name) {
      return c.more.contains(name) ? fixed(c.more.at(name), 0) : std::string("-");
    };
    seconds += c.more.contains("total_seconds") ? c.more.at("total_seconds") : c.seconds;
    rows.push_back({c.name.stem(), std::to_string(c.steps), fixed(c.seconds, 1), more("total_seconds"),
                    more("views"), more("distorted_views"), more("test_images"),
                    more("width") + " x " + more("height"), c.commit});
  }
  return markdown_table({"cell", "steps", "seconds of training", "seconds in all", "novel views",
                         "under distortion", "ground truth", "pixels", "commit"},
                        rows) +
         "\nIn all " + std::to_string(cells.size()) + " cells, " + fixed(seconds / 3600, 2) + " hours.\n";
}

}  // namespace

void write_paper_page(const std::filesystem::path& folder, const std::filesystem::path& page) {
  const auto cells = baselines::load_cells(folder);
  if (cells.empty()) return;
  const auto beside = [&](const std::string& name) { return page.parent_path() / name; };
  std::vector<std::string> figures;
  for (const auto& [name, svg] : paper_figures(cells)) {
    write_file_atomically(beside(name), svg);
    figures.push_back(name);
  }
  std::string notes;
  for (const PaperSheet& sheet : paper_sheets()) {
    const auto stems = write_paper_sheet(sheet, cells, folder, beside(sheet.name));
    if (stems.empty()) continue;
    figures.push_back(sheet.name);
    notes += "\nRows of " + sheet.name + " (unmarked, marked, " + fixed(static_cast<double>(sheet.gain), 0) +
             " times the difference):";
    for (const auto& stem : stems) notes += " " + stem;
    notes += "\n";
  }
  write_file_atomically(page, paper_page(cells, figures, notes));
}

std::string paper_page(const std::vector<Cell>& cells, const std::vector<std::string>& figures,
                       const std::string& notes) {
  const auto groups = groups_of(cells);
  std::string text =
      "# The paper's tables\n\nWritten by `fieldmark reproduce` from the cells alone. Published figures, in "
      "brackets: " +
      std::string(baselines::kPublishedSource) +
      ". Bit accuracy: of one view, mean over random novel views with a message each (at 4 bits all 16 in "
      "turns), ± its standard deviation over views. Differences to the unmarked render and to the ground "
      "truth are "
      "separate columns, never to be compared with each other; the published PSNR is almost certainly "
      "against the "
      "ground truth.\n\n| system | what is trained |\n| --- | --- |\n";
  for (const auto& s : baselines::paper_systems()) text += "| " + s.title + " | " + s.what + " |\n";
  text += "\n## Length of the message\n\n" + bits_table(groups) + "\n## Quality at 16 bits\n\n" +
          quality_table(groups) +
          "\n## Distortions at 16 bits\n\nSeverities are true: noise as standard "
          "deviation on [0, 1], blur as sigma in pixels. The paper's noise 0.1 and blur 0.1 are nearly the "
          "identity in the released code.\n\n" +
          distortion_table(groups) +
          "\n## Ablation\n\nThe paper does not state the length of its message; ours is 16 bits.\n\n" +
          ablation_table(groups) + "\n## Sampling points at test\n\n" +
          named_table(groups, "sampling", "sampling_") + "\n## Noise on the weights\n\n" +
          named_table(groups, "weights", "weights_") +
          "\n## Cameras of the authors' code\n\nA ring at an elevation of 30 degrees and a distance of "
          "4.0311.\n\n" +
          named_table(groups, "cameras", "cameras_") + "\n## Order of the rows\n\n" + order_of_rows(groups);
  if (!notes.empty()) text += "\n" + notes;
  text += "\n## Figures\n\n";
  for (const auto& f : figures) text += "![" + f + "](" + f + ")\n\n";
  return text + "## Cells\n\n" + protocol_table(cells);
}

}  // namespace fieldmark::results
