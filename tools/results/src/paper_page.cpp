#include <fieldmark/tools/results/paper_page.h>

#include <fieldmark/baselines/departures.h>
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/baselines/published.h>
#include <fieldmark/core/files.h>
#include <fieldmark/tools/results/paper_figures.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
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

// Our figure, and the paper's in brackets where it has one.
std::string beside(const std::string& ours, const char* table, const std::string& system,
                   const std::string& column, int digits = 2) {
  const auto value = published(table, system, column);
  return value ? ours + " (" + fixed(*value, digits) + ")" : ours;
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

// Groups the cells by system, in the order of paper_systems(), then in their own order.
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

// Returns the standard error of the mean bit accuracy: over the seeds, or over the views of a single run.
double standard_error(const Group& g) {
  const double count = static_cast<double>(g.cells.size());
  if (g.cells.size() == 1) return g.cells[0]->spread / std::sqrt(mean_more(g.cells, "views"));
  const double middle = mean(g.cells, &Cell::bit_accuracy);
  double squares = 0;
  for (const Cell* c : g.cells) squares += std::pow(c->bit_accuracy - middle, 2);
  return std::sqrt(squares / (count - 1) / count);
}

std::string accuracy_of(const Group& g) {
  std::string text = percent(mean(g.cells, &Cell::bit_accuracy)) + " ± " + percent(standard_error(g));
  return g.cells.size() > 1 ? text + ", " + std::to_string(g.cells.size()) + " seeds" : text;
}

std::string steps_of(const Group& g) {
  double sum = 0;
  for (const Cell* c : g.cells) sum += static_cast<double>(c->steps);
  return fixed(sum / static_cast<double>(g.cells.size()), 0);
}

// Every row states its training steps.
const Row kStart{"system", "scene", "field", "steps"};
Row start_of(const Group& g) { return {g.title, g.scene, g.field, steps_of(g)}; }

// The scene with most systems at 16 bits on the hash field.
std::string main_scene(const std::vector<Group>& groups) {
  std::map<std::string, int> systems;
  for (const Group& g : groups)
    if (g.bits == 16 && g.field == "hash") ++systems[g.scene];
  const auto most = std::ranges::max_element(systems, {}, [](const auto& entry) { return entry.second; });
  return most == systems.end() ? "" : most->first;
}

std::string first_table(const std::vector<Group>& groups) {
  const std::string scene = main_scene(groups);
  std::vector<Row> rows;
  for (const Group& g : groups)
    if (g.bits == 16 && g.field == "hash" && g.scene == scene)
      rows.push_back({g.title, beside(accuracy_of(g), "quality", g.system, "accuracy"),
                      beside(fixed(mean(g.cells, &Cell::psnr_gt), 2), "quality", g.system, "psnr"),
                      fixed(mean(g.cells, &Cell::psnr_base), 2), steps_of(g),
                      fixed(mean(g.cells, &Cell::seconds) / 60, 1)});
  if (rows.empty()) return "No cell has been measured.\n";
  return "16 bits, " + scene + ", hash field.\n\n" +
         markdown_table({"system", "bits right, %", "PSNR to ground truth", "PSNR to the unmarked render",
                         "steps", "minutes of training"},
                        rows);
}

const std::vector<Index> kLengths{4, 8, 16, 32, 48};

std::string bits_table(const std::vector<Group>& groups) {
  Row header{"system", "scene", "field"};
  for (const Index n : kLengths) header.push_back(std::to_string(n) + " bits: % right, steps");
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
      row.push_back(found == groups.end() ? "-"
                                          : beside(accuracy_of(*found), "bits", g.system, std::to_string(n)) +
                                                ", " + steps_of(*found));
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
      return beside(fixed(ours, digits), "quality", g.system, column, digits);
    };
    Row row = start_of(g);
    row.insert(
        row.end(),
        {beside(accuracy_of(g), "quality", g.system, "accuracy"),
         percent(mean(g.cells, &Cell::own_2d_accuracy)), fixed(mean(g.cells, &Cell::psnr_base), 2),
         fixed(mean(g.cells, &Cell::psnr_base_foreground), 2), fixed(mean_more(g.cells, "ssim_base"), 3),
         fixed(mean_more(g.cells, "lpips_base"), 3), both(mean(g.cells, &Cell::psnr_gt), "psnr", 2),
         fixed(mean_more(g.cells, "psnr_gt_unmarked"), 2), both(mean(g.cells, &Cell::ssim), "ssim", 3),
         both(mean(g.cells, &Cell::lpips), "lpips", 3)});
    rows.push_back(row);
  }
  Row header = kStart;
  header.insert(header.end(),
                {"bits right, %", "2-D network on its own images, %", "PSNR to the unmarked render",
                 "the same on the foreground", "SSIM to it", "LPIPS to it", "PSNR to ground truth",
                 "of the unmarked field", "SSIM to ground truth", "LPIPS to ground truth"});
  return markdown_table(header, rows);
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
  Row header = kStart;
  header.push_back("none");
  for (const Severity& s : under) header.push_back(s.name);
  std::vector<Row> rows;
  for (const Group& g : groups) {
    if (g.bits != 16 || g.cells.front()->under.empty()) continue;
    Row row = start_of(g);
    row.push_back(beside(percent(mean(g.cells, &Cell::bit_accuracy)), "distortion", g.system, "none"));
    for (const Severity& s : under)
      row.push_back(beside(percent(mean_under(g.cells, s.name)), "distortion", g.system, s.name));
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
      return beside(fixed(ours, digits), "ablation", g.system, column, digits);
    };
    Row row = start_of(g);
    row.insert(row.end(),
               {beside(accuracy_of(g), "ablation", g.system, "accuracy"),
                fixed(mean(g.cells, &Cell::psnr_base), 2), both(mean(g.cells, &Cell::psnr_gt), "psnr", 2),
                both(mean(g.cells, &Cell::ssim), "ssim", 3), both(mean(g.cells, &Cell::lpips), "lpips", 3)});
    rows.push_back(row);
  }
  Row header = kStart;
  header.insert(header.end(), {"bits right, %", "PSNR to the unmarked render", "PSNR to ground truth",
                               "SSIM to ground truth", "LPIPS to ground truth"});
  return markdown_table(header, rows);
}

// One column for each name of `under` that begins with the prefix, beside the published figures of a table.
std::string named_table(const std::vector<Group>& groups, const char* table, const std::string& prefix) {
  std::set<std::string> names;
  for (const Group& g : groups)
    for (const Cell* c : g.cells)
      for (const auto& [name, value] : c->under)
        if (name.starts_with(prefix)) names.insert(name);
  if (names.empty()) return "No cell has been measured.\n";
  Row header = kStart;
  header.insert(header.end(), {"bits", "as trained"});
  header.insert(header.end(), names.begin(), names.end());
  std::vector<Row> rows;
  for (const Group& g : groups) {
    Row row = start_of(g);
    row.insert(row.end(), {std::to_string(g.bits), percent(mean(g.cells, &Cell::bit_accuracy))});
    bool any = false;
    for (const auto& name : names) {
      const double value = mean_under(g.cells, name);
      any = any || std::isfinite(value);
      const std::string column = prefix == "sampling_" ? name.substr(prefix.size()) : name;
      row.push_back(beside(percent(value), table, g.system, column));
    }
    if (any) rows.push_back(row);
  }
  return markdown_table(header, rows);
}

std::string departures_table() {
  std::vector<Row> rows;
  for (const auto& d : baselines::departures())
    rows.push_back({d.part, d.paper, d.code, d.preset_paper, d.preset_code});
  return markdown_table({"part", "paper", "authors' code", "preset paper", "preset code"}, rows);
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
      const double error = std::hypot(standard_error(a), standard_error(b));
      if (!(ours_b - ours_a > 2 * error)) continue;
      text += "- " + a.scene + ", " + a.field + " field: " + a.title + " (" + percent(ours_a) + "%, " +
              steps_of(a) + " steps) stands below " + b.title + " (" + percent(ours_b) + "%, " + steps_of(b) +
              " steps); the paper has " + fixed(*pa, 2) + "% above " + fixed(*pb, 2) + "%\n";
    }
  return text.empty()
             ? "No two systems with figures in both stand in another order than the paper's.\n"
             : "Two systems are listed where they are more than two standard errors apart.\n\n" + text;
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

bool write_paper_page(const std::filesystem::path& folder, const std::filesystem::path& page) {
  const auto cells = baselines::load_cells(folder);
  if (cells.empty()) return false;
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
  return true;
}

std::string paper_page(const std::vector<Cell>& cells, const std::vector<std::string>& figures,
                       const std::string& notes) {
  const auto groups = groups_of(cells);
  std::string text =
      "# The paper's tables\n\nWritten by `fieldmark reproduce` from the cells alone. Published figures "
      "stand "
      "in brackets: " +
      std::string(baselines::kPublishedSource) +
      ". Bit accuracy is of one view: the mean over random novel views with a message each (at 4 bits all 16 "
      "in "
      "turns), ± its standard error, over views in one run and over seeds in several. A system that reads "
      "half "
      "of the bits has learnt nothing in its steps; that says nothing of its method. Differences to the "
      "unmarked render and to the ground truth are separate columns, never to be compared with each other; "
      "the "
      "published PSNR is almost certainly against the ground truth.\n\n## In one table\n\n" +
      first_table(groups) + "\n## Systems\n\n| system | what is trained |\n| --- | --- |\n";
  for (const auto& s : baselines::paper_systems()) text += "| " + s.title + " | " + s.what + " |\n";
  text +=
      "\n## Departures\n\nWhat the presets take from the paper and from its authors' code, and what they do "
      "in its place; "
      "\"-\": not given, or as the paper. `embed` uses the values of the last two columns.\n\n" +
      departures_table();
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
