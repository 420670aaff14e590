#include <fieldmark/tools/results/paper_page.h>

#include <fieldmark/baselines/departures.h>
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/baselines/published.h>
#include <fieldmark/core/files.h>
#include <fieldmark/tools/results/paper_figures.h>
#include <fieldmark/tools/results/report.h>

#include <algorithm>

#include "paper_tables.h"

namespace fieldmark::results {
namespace {

using baselines::Cell;
using Row = Words;

constexpr const char* kTitle = R"(# CopyRNeRF's tables, measured again

CopyRNeRF puts a message into a radiance field and reads it from rendered views. This page measures its systems
and ours; `fieldmark reproduce` writes it from the cells alone. Figures in brackets are published: )";

constexpr const char* kHowToRead = R"(.
They are not of a single scene, so the same figure stands beside ours on every scene.

"Bits right" is the share of a message's bits that is read from a single novel view, averaged over views. Each view
has a random message of its own; with 4 bits, the 16 messages are used in rotation. HiDDeN + NeRF and MBRS + NeRF have one
message and its complement instead, so their standard error says little. ± is the standard error over the views of
one run, or over seeds where several are named. Over views, it does not include the variance between runs.

Half of the bits is chance. HiDDeN + NeRF and MBRS + NeRF are at chance because the field loses a mark that their
networks can read. Other systems at chance were not trained for long enough, which says nothing about
their methods. PSNR to the ground truth includes the field's own error, and PSNR to the unmarked render does not. The
published PSNR is taken to be against the ground truth.

## In one table

)";

constexpr const char* kSameViews =
    R"(The first column of accuracy is of all views. The others are of the fewer views
under distortion (see Cells), whose standard error is up to 3 points at chance and less near 100%.

)";

constexpr const char* kDistortions =
    R"(Noise: standard deviation on [0, 1]. Blur: sigma in pixels. Rotation: a random
angle of up to the given number of degrees. In the authors' code, noise 0.1 and blur 0.1 hardly change the image, so
compare the published figures of these two columns with our column "none".

)";

constexpr const char* kCameras =
    R"(A ring at an elevation of 30 degrees and a distance of 4.0311, with as many views
as under distortion (see Cells); "as trained" is of all novel views.

)";

constexpr const char* kAblation =
    R"(Only rows of one budget and one commit (see Cells) can be compared. The paper
does not state the length of its message; ours is 16 bits.

)";

constexpr const char* kLonger =
    R"(Cells with more training than those of the tables above. Each stands below the row of the tables that
differs in the budget alone; paper_learning_longer.svg, under Figures, has its curve. The paper loses 12 points under
rotation without DRR. Here the warm start teaches carriers that are textures, and the extractor averages over all
pixels. Neither depends on the direction or the position of a pixel, which is probably why rotations cost so little.

)";

constexpr const char* kDepartures = R"(
## Departures

E turns a position and its colour into N_c features f_c, D a message into N_m features f_M, and G both into the marked
colour c_m; H reads an image. MFF are the features of the message, CFF those of the colour, DRR the distortions in
training. The table has what the paper and its authors' code say, and what the presets of this version do in its
place; "-": not given, or as the paper. Cells of older commits had older presets (docs/notes/paper_rows.md).

)";

constexpr const char* kFigures = R"(
## Figures

Learning curves are of training images, not of novel views. A curve of a "2-D network" is of windows that the
network marks itself. During the warm start, the extractor reads fixed carriers and not the mark; the fall after it
is where the mark itself is first read. Figures show one seed of each cell; tables average over seeds.

)";

std::string departures_table() {
  std::vector<Row> rows;
  for (const auto& d : baselines::departures())
    rows.push_back({d.part, d.paper, d.code, d.preset_paper, d.preset_code});
  return markdown_table({"part", "paper", "authors' code", "preset paper", "preset code"}, rows);
}

// Labels the rows of a sheet.
std::string sheet_text(const PaperSheet& sheet, const std::vector<Cell>& cells,
                       const std::vector<std::string>& stems) {
  std::vector<Row> rows;
  for (const auto& stem : stems) {
    const Cell& c = *std::ranges::find_if(cells, [&](const Cell& cell) { return cell.name.stem() == stem; });
    rows.push_back({std::to_string(rows.size() + 1), baselines::paper_system(c.name.system).title,
                    c.name.scene, c.name.field, std::to_string(c.steps), percent(c.bit_accuracy),
                    fixed(c.psnr_base, 2)});
  }
  return "\n### " + sheet.name +
         "\n\nThe first test view. Left: unmarked. Middle: marked with a message of 16 bits. Right: " +
         fixed(static_cast<double>(sheet.gain), 0) +
         " times the difference on grey, cut off at black and white. A flat colour in the middle is a system "
         "that has not yet restored the colours. Rows from the top:\n\n" +
         markdown_table(
             {"row", "system", "scene", "field", "steps", "bits right, %", "PSNR to the unmarked render"},
             rows) +
         "\n![" + sheet.name + "](" + sheet.name + ")\n";
}

}  // namespace

PaperCells load_paper_cells(const std::filesystem::path& folder) {
  return {baselines::load_cells(folder), baselines::load_cells(folder / kLongerCells)};
}

bool write_paper_page(const std::filesystem::path& folder, const std::filesystem::path& page,
                      const StaleReason& stale) {
  const PaperCells cells = load_paper_cells(folder);
  if (cells.tables.empty() && cells.longer.empty()) return false;
  const auto beside = [&](const std::string& name) { return page.parent_path() / name; };
  std::vector<std::string> figures;
  for (const auto& [name, svg] : paper_figures(cells)) {
    write_file_atomically(beside(name), svg);
    figures.push_back(name);
  }
  std::string sheets;
  for (const PaperSheet& sheet : paper_sheets()) {
    const auto stems = write_paper_sheet(sheet, cells.tables, folder, beside(sheet.name));
    if (!stems.empty()) sheets += sheet_text(sheet, cells.tables, stems);
  }
  write_file_atomically(page, paper_page(cells, figures, sheets, stale));
  return true;
}

std::string paper_page(const PaperCells& cells, const std::vector<std::string>& figures,
                       const std::string& sheets, const StaleReason& stale) {
  const auto groups = paper_groups(cells.tables), longer = paper_groups(cells.longer);
  std::string text = kTitle + std::string(baselines::kPublishedSource) + kHowToRead + first_table(groups) +
                     "\n## Systems\n\n| system | what is trained |\n| --- | --- |\n";
  for (const auto& s : baselines::paper_systems()) text += "| " + s.title + " | " + s.what + " |\n";
  const auto section = [&](const char* title, const std::string& introduction, const std::string& table) {
    text += std::string("\n## ") + title + "\n\n" + introduction + table;
  };
  section("Length of the message", "Cells of a row may differ in budget and commit (see Cells).\n\n",
          bits_table(groups));
  section("Quality at 16 bits", "", quality_table(groups));
  section("Distortions at 16 bits", std::string(kDistortions) + kSameViews, distortion_table(groups));
  section("Ablation", kAblation, ablation_table(groups));
  section("Sampling points at test", kSameViews, named_table(groups, "sampling", "sampling_"));
  section("Noise on the weights", kSameViews, named_table(groups, "weights", "weights_"));
  section("Cameras of the authors' code", kCameras, named_table(groups, "cameras", "cameras_"));
  section("Order of the rows",
          "Pairs of different budgets or commits (see Cells) do not compare methods.\n\n",
          order_of_rows(groups));
  if (!longer.empty()) section("Longer budgets", kLonger, longer_table(longer, groups));
  text += kDepartures + departures_table() + kFigures;
  for (const auto& f : figures) text += "![" + f + "](" + f + ")\n\n";
  text += sheets;
  section("Cells", "", protocol_table(cells, stale));
  return text;
}

}  // namespace fieldmark::results
