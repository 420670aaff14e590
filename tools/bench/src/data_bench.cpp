#include <fieldmark/core/private_folder.h>
#include <fieldmark/imaging/metrics.h>
#include <fieldmark/nerf/renderer.h>
#include <fieldmark/nerf/trainer.h>
#include <fieldmark/tools/bench/data_bench.h>

#include "training_loop.h"

namespace fieldmark::bench {
namespace {

double psnr_of(const nerf::RadianceField& field, const std::vector<JudgedView>& test,
               const nerf::Vec3& moved) {
  nerf::Renderer renderer(field);
  double sum = 0;
  for (const JudgedView& view : test) {
    nerf::Camera camera = view.camera;
    for (std::size_t k = 0; k < 3; ++k) camera.pose[4 * k + 3] += moved[k];
    sum += psnr_masked(renderer.render(camera).rgb, view.rgb, view.counted);
  }
  return sum / static_cast<double>(test.size());
}

struct FormRun {
  double seconds;
  std::uint64_t seed;
};

// Trains on a written form. steps: 0 for a timed run.
DataRow trained(const DataGroup& group, const DataForm& form, const std::filesystem::path& folder,
                Index steps, const FormRun& run, const std::function<void(double)>& progress) {
  const nerf::Dataset train =
      nerf::load_dataset(folder, {.split = "train", .background = nerf::Background::white});
  nerf::RadianceFieldOptions sizes = nerf::field_options({.seconds = run.seconds});
  sizes.seed = run.seed;
  nerf::RadianceField field(sizes);
  const ScheduleOptions schedule{.steps = steps, .seconds = run.seconds};
  nerf::Trainer trainer(field, train, {.schedule = schedule, .seed = run.seed});
  train_to_end(trainer, schedule, progress);
  return {.scene = group.scene,
          .form = form.name,
          .type = train.scene,
          .steps = trainer.steps(),
          .psnr = psnr_of(field, group.test, form.moved),
          .most_loss = form.most_loss};
}

}  // namespace

std::vector<DataRow> run_data_bench(const DataGroup& group, double seconds, std::uint64_t seed,
                                    const std::function<void(const std::string&, double)>& progress) {
  const PrivateFolder folder("data");
  std::vector<DataRow> rows;
  for (const DataForm& form : group.forms) {
    const auto told = [&](double part) {
      if (progress)
        progress(form.name,
                 (static_cast<double>(rows.size()) + part) / static_cast<double>(group.forms.size()));
    };
    const auto place = folder.path / ("form" + std::to_string(rows.size()));
    std::filesystem::create_directories(place);
    told(0);
    form.write(place);
    rows.push_back(trained(group, form, place, rows.empty() ? 0 : rows.front().steps, {seconds, seed}, told));
    rows.back().loss = rows.front().psnr - rows.back().psnr;
    std::filesystem::remove_all(place);
  }
  return rows;
}

}  // namespace fieldmark::bench
