#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/core/error.h>

#include <algorithm>
#include <array>
#include <initializer_list>

namespace fieldmark::baselines {
namespace {

const std::array kSystems{
    PaperSystem{"ours", "Fieldmark, preset fast",
                "a bit in every cell of the scene, read place by place, under a budget of power"},
    PaperSystem{"copyrnerf_paper", "CopyRNeRF, preset paper",
                "one message fused into every colour, read from the whole image, under distortions"},
    PaperSystem{
        "copyrnerf_code", "CopyRNeRF, preset code",
        "preset paper with networks shaped like the authors' code's, without distortions in training"},
    PaperSystem{
        "hidden_nerf", "HiDDeN + NeRF",
        "training images marked by HiDDeN (32 channels) at 30 dB, a field trained on them, its renders read",
        false},
    PaperSystem{
        "mbrs_nerf", "MBRS + NeRF",
        "training images marked by MBRS (32 channels) at 30 dB, a field trained on them, its renders read",
        false},
    PaperSystem{
        "nerf_message", "NeRF with message",
        "the message beside the inputs of the field's networks, trained on from the unmarked field's"},
    PaperSystem{"geometry", "CopyRNeRF in geometry",
                "the message fused into the density, colours left as they are"},
    PaperSystem{"nerf_hidden", "NeRF + HiDDeN", "renders of an unmarked field marked by HiDDeN at 30 dB",
                false},
    PaperSystem{"nerf_mbrs", "NeRF + MBRS", "renders of an unmarked field marked by MBRS at 30 dB", false},
    PaperSystem{"cold_start", "CopyRNeRF, cold start", "preset paper without the warm start", true, true},
    PaperSystem{"without_drr", "CopyRNeRF without DRR", "neither distortions nor moved samples in training",
                true, true},
    PaperSystem{"without_mff", "CopyRNeRF without MFF", "the message itself in the fusion, not its features",
                true, true},
    PaperSystem{"without_cff", "CopyRNeRF without CFF", "the colour itself in the fusion, not its features",
                true, true},
    PaperSystem{"drs", "CopyRNeRF, DRS", "preset paper, with samples moved at test as in training", true,
                true},
    PaperSystem{"ours_without_dense", "Fieldmark without dense supervision",
                "the bits of the whole image teach, not signs and cells of its places", true, true},
    PaperSystem{"ours_without_cells", "Fieldmark without cells",
                "preset paper's networks, one message everywhere, under our budget of power", true, true},
    PaperSystem{"ours_without_signs", "Fieldmark without keyed signs",
                "a cell shows its bit as it is, not with the sign that the key gives it", true, true}};

constexpr std::array<std::string_view, 6> kTables{"bits",     "quality",  "distortion",
                                                  "ablation", "sampling", "weights"};
constexpr std::array<Index, 5> kLengths{4, 8, 16, 32, 48};
constexpr Index kBits = 16, kWeightBits = 8;

class Plan {
 public:
  explicit Plan(const PlanOptions& options) : options_(options) {}
  void add(std::initializer_list<const char*> systems, const std::string& scene, std::span<const Index> bits,
           const char* field = "hash") {
    for (std::uint64_t k = 0; k < (options_.full ? 3u : 1u); ++k)
      for (const Index n : bits)
        for (const char* system : systems) {
          const CellName name{system, scene, field, n, options_.seed + k};
          if (std::find(cells_.begin(), cells_.end(), name) == cells_.end()) cells_.push_back(name);
        }
  }
  std::vector<CellName> take() { return std::move(cells_); }

 private:
  const PlanOptions& options_;
  std::vector<CellName> cells_;
};

constexpr std::initializer_list<const char*> kMain{"ours", "copyrnerf_paper", "hidden_nerf", "nerf_message",
                                                   "geometry"};
constexpr std::initializer_list<const char*> kAll{"ours",        "copyrnerf_paper", "hidden_nerf",
                                                  "mbrs_nerf",   "nerf_message",    "geometry",
                                                  "nerf_hidden", "nerf_mbrs"};

void plan_scene(PaperTable table, const std::string& scene, bool first, bool full, Plan& plan) {
  const std::span<const Index> one(&kBits, 1), weights(&kWeightBits, 1);
  const auto main = first || full ? kAll : kMain;
  switch (table) {
    case PaperTable::bits:
      if (full) return plan.add(kAll, scene, kLengths);
      if (!first) return;
      plan.add({"ours", "copyrnerf_paper", "nerf_message", "geometry"}, scene, kLengths);
      return plan.add({"hidden_nerf", "mbrs_nerf"}, scene, one);
    case PaperTable::quality:
      plan.add(main, scene, one);
      if (!first && !full) return;
      plan.add({"copyrnerf_code"}, scene, one);
      return plan.add({"copyrnerf_paper"}, scene, one, "mlp");
    case PaperTable::distortion:
      plan.add(main, scene, one);
      if (first || full) plan.add({"without_drr"}, scene, one);
      return;
    case PaperTable::ablation:
      if (first || full)
        plan.add({"copyrnerf_paper", "cold_start", "without_drr", "without_mff", "without_cff", "drs", "ours",
                  "ours_without_dense", "ours_without_cells", "ours_without_signs"},
                 scene, one);
      return;
    case PaperTable::sampling:
      if (first || full) plan.add({"copyrnerf_paper"}, scene, one, "mlp");
      return;
    case PaperTable::weights:
      if (first || full) plan.add({"copyrnerf_paper", "ours"}, scene, weights);
      return;
  }
}

}  // namespace

std::span<const PaperSystem> paper_systems() { return kSystems; }

const PaperSystem& paper_system(std::string_view name) {
  for (const PaperSystem& s : kSystems)
    if (s.name == name) return s;
  std::string known;
  for (const PaperSystem& s : kSystems) known += (known.empty() ? "" : ", ") + s.name;
  throw ValueError("[paper_system] name must be one of " + known + ", got " + std::string(name));
}

std::span<const std::string_view> paper_table_names() { return kTables; }

PaperTable parse_paper_table(std::string_view name) {
  const auto found = std::find(kTables.begin(), kTables.end(), name);
  if (found == kTables.end())
    throw ValueError(
        "[paper_table] name must be bits, quality, distortion, ablation, sampling or weights, got " +
        std::string(name));
  return static_cast<PaperTable>(found - kTables.begin());
}

std::vector<CellName> plan_cells(PaperTable table, const PlanOptions& options) {
  if (options.scenes.empty()) throw ValueError("[plan_cells] scenes must not be empty");
  Plan plan(options);
  for (const std::string& scene : options.scenes)
    plan_scene(table, scene, &scene == &options.scenes.front(), options.full, plan);
  return plan.take();
}

}  // namespace fieldmark::baselines
