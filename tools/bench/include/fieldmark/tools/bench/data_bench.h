#pragma once
#include <fieldmark/tools/bench/data_forms.h>

namespace fieldmark::bench {

/// Result of training on a form.
struct DataRow {
  std::string scene, form;
  nerf::SceneType type = nerf::SceneType::object;  ///< as load_dataset() decided
  Index steps = 0;
  double psnr = 0;       ///< mean over the test views, of the pixels that count, dB
  double loss = 0;       ///< dB less than the plain form
  double most_loss = 0;  ///< see DataForm
};

/// Writes each form, loads it and trains a field: on the plain form for a given time, on the others for as
/// many steps. All have the size that `train` gives a run of this length.
/// @param progress  called with the form and the share done of all
/// @throws IoError if the temporary folder of the forms cannot be written
std::vector<DataRow> run_data_bench(const DataGroup& group, double seconds, std::uint64_t seed,
                                    const std::function<void(const std::string&, double)>& progress);

}  // namespace fieldmark::bench
