#include <fieldmark/baselines/cell_runner.h>
#include <fieldmark/baselines/owner_system.h>
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/engine/files.h>
#include <fieldmark/engine/image.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/trainer.h>

#include <algorithm>
#include <memory>
#include <system_error>

namespace fieldmark::baselines {
namespace {

constexpr Index kBlenderSize = 160, kPhotographSize = 252, kMlpSize = 100;  // METHOD: as in the released code
constexpr double kHashSeconds = 60;  // more does not show at these sizes
constexpr double kViewsASecond = 1;  // to learn from, for each second of the budget
constexpr Index kFewestViews = 8, kMostViews = 200;
constexpr std::uint64_t kCamerasSeed = 1000;  // views that are measured are not those learnt from

// Of a split, evenly spread.
void thin_out(nerf::Dataset& data, Index most) {
  const auto n = static_cast<Index>(data.views.size());
  if (n <= most) return;
  std::vector<nerf::View> kept;
  for (Index i = 0; i < most; ++i)
    kept.push_back(std::move(data.views[static_cast<std::size_t>(i * n / most)]));
  data.views = std::move(kept);
}

nerf::Dataset split_of(const PaperScene& scene, Index size, const char* split) {
  if (scene.folder.empty()) return nerf::make_scene({.size = size}, split);
  return nerf::load_dataset(scene.folder, {.split = split, .size = size});
}

bool is_mlp(const CellName& name) { return name.field == "mlp"; }

}  // namespace

struct CellRunner::Scene {
  std::string name;
  Index size;
  nerf::Dataset train, test;
};

// A system after its training: how it is measured, and what keeps it alive.
struct CellRunner::Trained {
  Index steps = 0;
  double seconds = 0, own_2d_accuracy = std::nan("");
  std::shared_ptr<const nerf::RadianceField> unmarked;
  std::shared_ptr<const watermark::Owner> owner;
  MarkedScene marked;
};

CellRunner::CellRunner(CellRunnerOptions options) : options_(std::move(options)) {
  if (options_.scenes.empty()) throw ValueError("[cell_runner] scenes must not be empty");
  if (!(options_.budget > 0) || options_.views < 1 || options_.photographs < 1)
    throw ValueError("[cell_runner] budget, views and photographs must be positive, got " +
                     std::to_string(options_.budget) + ", " + std::to_string(options_.views) + " and " +
                     std::to_string(options_.photographs));
  std::error_code failed;
  std::filesystem::create_directories(options_.work, failed);
  if (failed) throw IoError(options_.work.string() + ": cannot make the folder: " + failed.message());
}

CellRunner::~CellRunner() = default;

bool CellRunner::tell(const std::string& what, double part, const std::string& note) const {
  return !options_.progress || options_.progress(what, part, note);
}

const CellRunner::Scene& CellRunner::scene(const CellName& name) {
  const auto found = std::find_if(options_.scenes.begin(), options_.scenes.end(),
                                  [&](const PaperScene& s) { return s.name == name.scene; });
  if (found == options_.scenes.end())
    throw ValueError("[cell_runner] name.scene must be one of the scenes given, got " + name.scene);
  if (name.field != "hash" && name.field != "mlp")
    throw ValueError("[cell_runner] name.field must be hash or mlp, got " + name.field);
  Index size = options_.size;
  if (size == 0 && is_mlp(name)) size = kMlpSize;
  if (size == 0)
    size = found->folder.empty() || nerf::find_layout(found->folder) == nerf::Layout::blender
               ? kBlenderSize
               : kPhotographSize;
  if (!scene_ || scene_->name != name.scene || scene_->size != size) {
    tell("reading " + name.scene, 0, "");
    scene_ = std::make_unique<Scene>(
        Scene{name.scene, size, split_of(*found, size, "train"), split_of(*found, size, "test")});
    thin_out(scene_->test, options_.photographs);
  }
  return *scene_;
}

// The unmarked field of a scene, the same for all systems of one seed.
nerf::RadianceField CellRunner::base_field(const CellName& name, const Scene& scene) {
  double seconds = options_.base_seconds;
  if (seconds <= 0) seconds = is_mlp(name) ? options_.budget : std::min(options_.budget, kHashSeconds);
  const std::string stem = "unmarked-" + name.scene + "-" + name.field + "-" + std::to_string(scene.size) +
                           "-" + std::to_string(name.seed);
  const auto path = options_.work / (stem + ".field"), checkpoint = options_.work / (stem + ".checkpoint");
  if (std::filesystem::exists(path)) return nerf::RadianceField::load(path);
  nerf::RadianceFieldOptions sizes{.seed = name.seed};
  if (is_mlp(name)) sizes.field.kind = nerf::FieldKind::mlp;
  nerf::RadianceField field(sizes);
  auto options = nerf::train_options(sizes.field.kind);
  options.schedule.seconds = seconds;
  options.seed = name.seed;
  nerf::Trainer trainer(field, scene.train, options);
  timed_run({.what = stem,
             .seconds = seconds,
             .done = [&] { return trainer.done(); },
             .step = [&](double now) { trainer.step(now); },
             .steps = [&] { return trainer.steps(); },
             .figure = [&] { return trainer.train_psnr(); },
             .save = [&](const auto& to) { trainer.save(to); },
             .restore = [&](const auto& from) { trainer.restore(from); },
             .checkpoint = checkpoint},
            options_.progress);
  field.save(path);
  remove_run_files(checkpoint);
  return nerf::RadianceField::load(path);  // as a later process will find it
}

CellRunner::Trained CellRunner::train(const CellName& name, const Scene& scene) {
  paper_system(name.system);
  const auto field = std::make_shared<nerf::RadianceField>(base_field(name, scene));
  const auto checkpoint = options_.work / (name.stem() + ".checkpoint");
  const auto views =
      std::clamp(static_cast<Index>(kViewsASecond * options_.budget), kFewestViews, kMostViews);
  TrainedOwner trained = train_owner(
      *field, name, owner_system(name, scene.size),
      {.seconds = options_.budget, .checkpoint = checkpoint, .views = views, .progress = options_.progress});
  const auto owner = std::make_shared<const watermark::Owner>(std::move(trained.owner));
  return {.steps = trained.steps,
          .seconds = trained.seconds,
          .unmarked = field,
          .owner = owner,
          .marked = marked_scene(*owner, name.seed)};
}

MeasuredCell CellRunner::run(const CellName& name) {
  const Scene& data = scene(name);
  const Trained trained = train(name, data);
  const auto& o = options_;
  const MarkScores s =
      score_mark(*trained.unmarked, trained.marked,
                 {.cameras = nerf::make_cameras(trained.unmarked->cameras, nerf::CameraSet::near, o.views, 0,
                                                name.seed + kCamerasSeed),
                  .under = name.bits == 16 ? o.under : std::vector<std::string>{},
                  .under_views = o.under_views,
                  .photographs = &data.test,
                  .seed = name.seed,
                  .lpips = o.lpips,
                  .progress = [&](double part) {
                    if (!tell(name.stem() + ": measure", part, ""))
                      throw Stopped(name.stem() + ": stopped while it was measured, its training is saved");
                    return true;
                  }});
  const nerf::Camera& camera = data.test.views.front().camera;
  const Tensor<float> pair[] = {nerf::Renderer(*trained.unmarked).render(camera).rgb,
                                trained.marked.render(camera, trained.marked.message(0))};
  const auto checkpoint = o.work / (name.stem() + ".checkpoint");
  return {.cell = {.name = name,
                   .steps = trained.steps,
                   .seconds = trained.seconds,
                   .bit_accuracy = s.accuracy,
                   .spread = s.spread,
                   .own_2d_accuracy = trained.own_2d_accuracy,
                   .psnr_base = s.psnr_base,
                   .psnr_base_object = s.psnr_base_object,
                   .psnr_photo = s.psnr_photo,
                   .ssim = s.ssim_photo,
                   .lpips = s.lpips_photo,
                   .under = s.under,
                   .commit = o.commit,
                   .more = {{"views", static_cast<double>(o.views)},
                            {"under_views", static_cast<double>(o.under_views)},
                            {"photographs", static_cast<double>(data.test.views.size())},
                            {"width", static_cast<double>(camera.width)},
                            {"height", static_cast<double>(camera.height)},
                            {"budget", o.budget},
                            {"ssim_base", s.ssim_base},
                            {"lpips_base", s.lpips_base},
                            {"psnr_photo_object", s.psnr_photo_object},
                            {"psnr_photo_unmarked", s.psnr_photo_unmarked}}},
          .picture = tile(pair, 2, 0),
          .curve = run_curve(checkpoint)};
}

void save_measured(const std::filesystem::path& folder, const MeasuredCell& measured) {
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw IoError(folder.string() + ": cannot make the folder: " + failed.message());
  const std::string stem = cell_path(folder, measured.cell.name).string();
  write_png(stem + ".png", measured.picture);
  write_file_atomically(stem + ".csv", measured.curve);
  save_cell(folder, measured.cell);
}

}  // namespace fieldmark::baselines
