#include "paper_tables.h"

#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/baselines/published.h>
#include <fieldmark/tools/results/report.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <set>

namespace fieldmark::results {
namespace {

using baselines::Cell;
using baselines::published;
using Row = Words;
using Groups = std::vector<PaperGroup>;

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

}  // namespace

std::string fixed(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

bool marks_training_images(const Cell& cell) { return cell.more.contains("training_images_accuracy"); }

std::string percent(double share) { return fixed(100 * share, 2); }

namespace {

// Returns the group of a system, scene, field and length; the end if there is none.
template <class AnyGroups>
auto find_group(AnyGroups& groups, const std::string& system, const std::string& scene,
                const std::string& field, Index bits) {
  return std::ranges::find_if(groups, [&](const PaperGroup& g) {
    return g.system == system && g.scene == scene && g.field == field && g.bits == bits;
  });
}

}  // namespace

std::vector<PaperGroup> paper_groups(const std::vector<Cell>& cells) {
  std::vector<PaperGroup> groups;
  for (const auto& system : baselines::paper_systems())
    for (const Cell& c : cells) {
      if (c.name.system != system.name) continue;
      auto found = find_group(groups, c.name.system, c.name.scene, c.name.field, c.name.bits);
      if (found == groups.end())
        found = groups.insert(groups.end(),
                              {c.name.system, system.title, c.name.scene, c.name.field, c.name.bits, {}});
      found->cells.push_back(&c);
    }
  return groups;
}

namespace {

// Returns the standard error of the mean bit accuracy: over the seeds, or over the views of a single run.
double standard_error(const PaperGroup& g) {
  const double count = static_cast<double>(g.cells.size());
  if (g.cells.size() == 1) return g.cells[0]->spread / std::sqrt(mean_more(g.cells, "views"));
  const double middle = mean(g.cells, &Cell::bit_accuracy);
  double squares = 0;
  for (const Cell* c : g.cells) squares += std::pow(c->bit_accuracy - middle, 2);
  return std::sqrt(squares / (count - 1) / count);
}

std::string accuracy_of(const PaperGroup& g) {
  std::string text = percent(mean(g.cells, &Cell::bit_accuracy)) + " ± " + percent(standard_error(g));
  return g.cells.size() > 1 ? text + ", " + std::to_string(g.cells.size()) + " seeds" : text;
}

std::string steps_of(const PaperGroup& g) {
  double sum = 0;
  for (const Cell* c : g.cells) sum += static_cast<double>(c->steps);
  return fixed(sum / static_cast<double>(g.cells.size()), 0);
}

// Every row states its budget of training and the steps that it took.
const Row kStart{"system", "scene", "field", "budget, s", "steps"};
Row start_of(const PaperGroup& g) {
  return {g.title, g.scene, g.field, fixed(mean_more(g.cells, "budget"), 0), steps_of(g)};
}

// Returns whether the accuracy differs from chance by more than two standard errors.
std::string against_chance(const PaperGroup& g) {
  if (marks_training_images(*g.cells.front())) return "-";
  const double above = mean(g.cells, &Cell::bit_accuracy) - 0.5;
  return std::abs(above) <= 2 * standard_error(g) ? "tie" : above > 0 ? "above" : "below";
}

// The scene with most systems at 16 bits on the hash field.
std::string main_scene(const Groups& groups) {
  std::map<std::string, int> systems;
  for (const PaperGroup& g : groups)
    if (g.bits == 16 && g.field == "hash") ++systems[g.scene];
  const auto most = std::ranges::max_element(systems, {}, [](const auto& entry) { return entry.second; });
  return most == systems.end() ? "" : most->first;
}

constexpr const char* kFirst =
    R"(; a field with a hash grid. Steps and minutes are those of the mark's training, without
the unmarked field; for HiDDeN and MBRS, steps are those of the 2-D network. Rows of different budgets do not compare
methods: what ties with chance after few steps may be above it after more.

)";

const std::vector<Index> kLengths{4, 8, 16, 32, 48};

// Names of distortions in order of kind, then severity.
struct Severity {
  std::string name, kind;
  double amount;
};

std::vector<Severity> severities(const Groups& groups) {
  std::vector<Severity> found;
  for (const PaperGroup& g : groups)
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

}  // namespace

std::string first_table(const Groups& groups) {
  const std::string scene = main_scene(groups);
  std::vector<Row> rows;
  for (const PaperGroup& g : groups)
    if (g.bits == 16 && g.field == "hash" && g.scene == scene)
      rows.push_back({g.title, beside(accuracy_of(g), "quality", g.system, "accuracy"),
                      beside(fixed(mean(g.cells, &Cell::psnr_gt), 2), "quality", g.system, "psnr"),
                      fixed(mean(g.cells, &Cell::psnr_base), 2), steps_of(g),
                      fixed(mean(g.cells, &Cell::seconds) / 60, 1), against_chance(g)});
  if (rows.empty()) return "No cell has been measured.\n";
  return "A message of 16 bits on the scene " + scene + kFirst +
         markdown_table({"system", "bits right, %", "PSNR to ground truth", "PSNR to the unmarked render",
                         "steps", "minutes of training", "against chance"},
                        rows);
}

std::string bits_table(const Groups& groups) {
  Row header{"system", "scene", "field"};
  for (const Index n : kLengths) header.push_back(std::to_string(n) + " bits: % right, steps");
  std::vector<Row> rows;
  std::set<std::string> seen;
  for (const PaperGroup& g : groups) {
    if (!seen.insert(g.system + "/" + g.scene + "/" + g.field).second) continue;
    Row row{g.title, g.scene, g.field};
    for (const Index n : kLengths) {
      const auto found = find_group(groups, g.system, g.scene, g.field, n);
      row.push_back(found == groups.end() ? "-"
                                          : beside(accuracy_of(*found), "bits", g.system, std::to_string(n)) +
                                                ", " + steps_of(*found));
    }
    rows.push_back(row);
  }
  return markdown_table(header, rows);
}

std::string quality_table(const Groups& groups) {
  std::vector<Row> rows;
  for (const PaperGroup& g : groups) {
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

std::string distortion_table(const Groups& groups) {
  const auto under = severities(groups);
  Row header = kStart;
  header.push_back("none");
  for (const Severity& s : under) header.push_back(s.name);
  std::vector<Row> rows;
  for (const PaperGroup& g : groups) {
    if (g.bits != 16 || g.cells.front()->under.empty()) continue;
    Row row = start_of(g);
    row.push_back(beside(percent(mean(g.cells, &Cell::bit_accuracy)), "distortion", g.system, "none"));
    for (const Severity& s : under)
      row.push_back(beside(percent(mean_under(g.cells, s.name)), "distortion", g.system, s.name));
    rows.push_back(row);
  }
  return markdown_table(header, rows);
}

std::string ablation_table(const Groups& groups) {
  const std::string scene = main_scene(groups);
  std::vector<Row> rows;
  for (const PaperGroup& g : groups) {
    const bool ablated = g.system.starts_with("copyrnerf_") || g.system == "drs" ||
                         g.system == "cold_start" || g.system.starts_with("without_") ||
                         g.system.starts_with("ours");
    if (g.bits != 16 || g.field != "hash" || g.scene != scene || !ablated) continue;
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

std::string named_table(const Groups& groups, const char* table, const std::string& prefix) {
  std::set<std::string> names;
  for (const PaperGroup& g : groups)
    for (const Cell* c : g.cells)
      for (const auto& [name, value] : c->under)
        if (name.starts_with(prefix)) names.insert(name);
  if (names.empty()) return "No cell has been measured.\n";
  Row header = kStart;
  header.insert(header.end(), {"bits", "as trained"});
  for (const auto& name : names) {
    header.push_back(name.substr(prefix.size()));
    std::ranges::replace(header.back(), '_', ' ');
  }
  std::vector<Row> rows;
  for (const PaperGroup& g : groups) {
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

std::string longer_table(const Groups& longer, const Groups& groups) {
  std::vector<Row> rows;
  const auto add = [&](const PaperGroup& g) {
    Row row = start_of(g);
    row.insert(row.end(),
               {std::to_string(g.bits), accuracy_of(g), percent(mean_under(g.cells, "rotation_30")),
                percent(mean(g.cells, &Cell::own_2d_accuracy)), fixed(mean(g.cells, &Cell::psnr_base), 2),
                fixed(mean(g.cells, &Cell::psnr_gt), 2)});
    rows.push_back(row);
  };
  for (const PaperGroup& g : longer) {
    if (const auto found = find_group(groups, g.system, g.scene, g.field, g.bits); found != groups.end())
      add(*found);
    add(g);
  }
  Row header = kStart;
  header.insert(header.end(),
                {"bits", "bits right, %", "under rotation_30, %", "2-D network on its own images, %",
                 "PSNR to the unmarked render", "PSNR to ground truth"});
  return markdown_table(header, rows);
}

std::string order_of_rows(const Groups& groups) {
  std::string reversed, ties;
  for (const PaperGroup& a : groups)
    for (const PaperGroup& b : groups) {
      const auto pa = published("quality", a.system, "accuracy"),
                 pb = published("quality", b.system, "accuracy");
      if (!pa || !pb || *pa <= *pb || a.bits != 16 || b.bits != 16 || a.scene != b.scene ||
          a.field != b.field || marks_training_images(*a.cells.front()) ||
          marks_training_images(*b.cells.front()))
        continue;
      const double by = mean(b.cells, &Cell::bit_accuracy) - mean(a.cells, &Cell::bit_accuracy),
                   error = std::hypot(standard_error(a), standard_error(b));
      if (by < -2 * error) continue;
      const auto told = [](const PaperGroup& g) {
        return g.title + " (" + percent(mean(g.cells, &Cell::bit_accuracy)) + "%, " + steps_of(g) + " steps)";
      };
      (by > 2 * error ? reversed : ties) += "- " + a.scene + ", " + a.field + " field: " + told(a) +
                                            (by > 2 * error ? " stands below " : " and ") + told(b) +
                                            "; the paper has " + fixed(*pa, 2) + "% above " + fixed(*pb, 2) +
                                            "%\n";
    }
  return "Pairs in the opposite order to the paper's, more than two standard errors apart:\n\n" +
         (reversed.empty() ? "- none\n" : reversed) +
         "\nTies, at most two standard errors apart, which the paper orders:\n\n" +
         (ties.empty() ? "- none\n" : ties);
}

std::string protocol_table(const PaperCells& cells, const StaleReason& stale) {
  std::vector<Row> rows;
  double seconds = 0;
  const auto add = [&](const Cell& c, const std::string& folder) {
    const auto more = [&](const char* name) {
      return c.more.contains(name) ? fixed(c.more.at(name), 0) : std::string("-");
    };
    seconds += c.more.contains("total_seconds") ? c.more.at("total_seconds") : c.seconds;
    rows.push_back({folder + c.name.stem(), std::to_string(c.steps), fixed(c.seconds, 1),
                    more("total_seconds"), more("budget"), more("views"), more("distorted_views"),
                    more("test_images"), more("width") + " x " + more("height"), c.commit});
    if (!stale) return;
    const std::string why = stale("paper/" + folder + c.name.stem());
    rows.back().push_back(why.empty() ? "fresh" : "stale: " + why);
  };
  for (const Cell& c : cells.tables) add(c, "");
  for (const Cell& c : cells.longer) add(c, std::string(kLongerCells) + "/");
  Row header{"cell",      "steps",       "seconds of training", "seconds in all",
             "budget, s", "novel views", "under distortion",    "ground truth",
             "pixels",    "commit"};
  if (stale) header.push_back("state");
  return markdown_table(header, rows) +
         "\nSeconds in all are of the cell's own run; a network that another cell trained counts there "
         "alone. In all " +
         std::to_string(rows.size()) + " cells, " + fixed(seconds / 3600, 2) + " hours.\n";
}

}  // namespace fieldmark::results
