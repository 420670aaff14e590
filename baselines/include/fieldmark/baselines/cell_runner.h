#pragma once
#include <fieldmark/baselines/cell.h>
#include <fieldmark/baselines/mark_scores.h>
#include <fieldmark/baselines/timed_run.h>
#include <fieldmark/nerf/dataset.h>

#include <memory>

namespace fieldmark::baselines {

/// A scene by the name that cells have.
struct PaperScene {
  std::string name;              ///< "lego"
  std::filesystem::path folder;  ///< of the data set; empty: the built-in scene
};

/// How cells are measured.
struct CellRunnerOptions {
  std::vector<PaperScene> scenes;  ///< at least one
  double budget = 300;             ///< seconds of a system's own training, > 0
  double base_seconds = 0;         ///< of the unmarked field's; 0: the budget, at most 60 s for a hash field
  nerf::RadianceFieldOptions hash{};  ///< sizes of hash fields; their seed is the cell's
  Index size = 0;  ///< pixels of the images' longer side; 0: 160 (Blender), 252 (others), 100 (mlp)
  /// Novel cameras that are read, at least 1; fewer, but no fewer than under_views, where reading them would
  /// take longer than `budget`.
  Index views = 200;
  Index under_views = 50;               ///< of them under each distortion and sampling
  Index ground_truth = 20;              ///< of the test split, evenly spread
  std::filesystem::path work;           ///< folder of checkpoints and unmarked fields
  std::vector<std::string> under;       ///< distortions of cells of 16 bits, names of parse_distortion()
  const Lpips<float>* lpips = nullptr;  ///< AlexNet, or null
  std::string commit;                   ///< of the sources, for the cells
  RunProgress progress = {};            ///< may be empty
};

/// A cell that is complete, with its images.
struct MeasuredCell {
  Cell cell;            ///< the numbers
  Tensor<float> image;  ///< [H, 2 W, 3] the first test view unmarked and, beside it, marked
};

/// Trains and measures cells one after another; scenes and unmarked fields are kept between them, fields and
/// checkpoints also between processes, in the work folder, for each budget in a folder of its own.
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
