#pragma once
#include <fieldmark/baselines/cell.h>
#include <fieldmark/baselines/mark_scores.h>
#include <fieldmark/baselines/timed_run.h>
#include <fieldmark/nerf/dataset.h>

#include <memory>

namespace fieldmark::baselines {

/// A scene under its name in cells.
struct PaperScene {
  std::string name;              ///< "lego"
  std::filesystem::path folder;  ///< folder of the data set; empty: the built-in scene
};

/// Options for measuring cells.
struct CellRunnerOptions {
  std::vector<PaperScene> scenes;  ///< at least one
  double budget = 300;             ///< training time of the system itself in seconds, > 0
  double base_seconds = 0;         ///< for the unmarked field; 0: the budget, at most 60 s for a hash field
  nerf::RadianceFieldOptions hash{};  ///< sizes of hash fields; the seed comes from the cell
  Index size = 0;  ///< longer side of the images in pixels; 0: 160 (Blender), 252 (others), 100 (mlp)
  /// Number of novel cameras to read, at least 1. Reads fewer, but no fewer than under_views, if reading all
  /// would take longer than `budget`.
  Index views = 200;
  Index under_views = 50;               ///< how many of them are read under each distortion and sampling
  Index ground_truth = 20;              ///< views of the test split, evenly spread
  std::filesystem::path work;           ///< folder for checkpoints and unmarked fields
  std::vector<std::string> under;       ///< distortions for cells of 16 bits, names of parse_distortion()
  const Lpips<float>* lpips = nullptr;  ///< AlexNet, or null
  std::string commit;                   ///< commit of the sources, stored in the cells
  RunProgress progress = {};            ///< may be empty
};

/// A complete cell with its image.
struct MeasuredCell {
  Cell cell;            ///< the numbers
  Tensor<float> image;  ///< [H, 2 W, 3] the first test view, unmarked on the left and marked on the right
};

/// Trains and measures cells one after another. Scenes and unmarked fields are reused between cells. Fields
/// and checkpoints also persist between processes, in one subfolder of the work folder per budget.
class CellRunner {
 public:
  /// @throws ValueError if there is no scene or a number is out of range
  explicit CellRunner(CellRunnerOptions options);
  ~CellRunner();
  /// @throws Stopped after saving   @throws ValueError if system, scene or field is unknown   @throws IoError
  MeasuredCell run(const CellName& name);

 private:
  struct Scene;
  struct Trained;
  const Scene& scene(const CellName& name);
  nerf::RadianceField base_field(const CellName& name, const Scene& scene);
  nerf::RadianceField trained_field(const std::string& stem, const nerf::Dataset& images,
                                    const CellName& name, double seconds);
  Trained train(const CellName& name, const Scene& scene);
  Trained train_hiding(const CellName& name, const Scene& scene,
                       const std::shared_ptr<const nerf::RadianceField>& unmarked);
  void read_variants(const CellName& name, const Trained& trained,
                     std::map<std::string, double>& under) const;
  bool tell(const std::string& what, double part, const std::string& note) const;

  CellRunnerOptions options_;
  std::unique_ptr<Scene> scene_;  // the last one used
};

}  // namespace fieldmark::baselines
