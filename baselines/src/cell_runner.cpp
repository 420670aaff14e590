#include <fieldmark/baselines/cell_runner.h>
#include <fieldmark/baselines/paper_plan.h>
#include <fieldmark/core/files.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/analytic_scene.h>
#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/trainer.h>
#include "hiding_system.h"
#include "hiding_trainer.h"
#include "owner_system.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <system_error>

namespace fieldmark::baselines {
namespace {

constexpr Index kBlenderSize = 160, kPhotographSize = 252, kMlpSize = 100;  // METHOD: as in the released code
constexpr double kHashSeconds = 60;       // longer training brings no visible gain at these sizes
constexpr double kViewsASecond = 1;       // training views per second of the budget
constexpr double kMlpViewsASecond = 0.2;  // of an mlp field, which takes seconds to render one
constexpr Index kFewestViews = 8, kMostViews = 200;
constexpr double kNetworkPart = 0.8;    // of the budget, for a 2-D network; the rest for fields
constexpr Index kNetworkChannels = 32;  // a quarter of the authors' work per step, with 64
constexpr Index kOwnImages = 200, kOwnSize = 64, kFixedMessage = 5;
constexpr Index kWeightsBits = 8;  // as the paper's noise of 0.01 on the weights
constexpr double kWeightsNoise = 0.01;
constexpr std::uint64_t kCamerasSeed = 1000;  // measured views differ from training views

// Keeps at most `most` views of a split, evenly spread.
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
  // HiDDeN and MBRS filter whole images, and all systems are compared on the same ones.
  return nerf::load_dataset(scene.folder, {.split = split, .size = size, .resampled = true});
}

bool is_mlp(const CellName& name) { return name.field == "mlp"; }

}  // namespace

struct CellRunner::Scene {
  std::string name;
  Index size;
  nerf::Dataset train, test;
};

// A trained system: how it is measured, and the objects that it needs.
struct CellRunner::Trained {
  Index steps = 0;
  double seconds = 0, own_2d_accuracy = std::nan("");
  std::shared_ptr<const nerf::RadianceField> unmarked;
  std::shared_ptr<const TrainedOwner> owner;
  MarkedScene marked;
  std::string curve;                   // of the network or mark, see TrainingRun::curve()
  std::map<std::string, double> more;  // for Cell::more
};

CellRunner::CellRunner(CellRunnerOptions options) : options_(std::move(options)) {
  if (options_.scenes.empty()) throw ValueError("[cell_runner] scenes must not be empty");
  if (!(options_.budget > 0) || options_.views < 1 || options_.ground_truth < 1)
    throw ValueError("[cell_runner] budget, views and ground truth must be positive, got " +
                     number_text(options_.budget) + ", " + std::to_string(options_.views) + " and " +
                     std::to_string(options_.ground_truth));
  // Fields and checkpoints of another budget cannot be reused.
  char of_budget[80];
  std::snprintf(of_budget, sizeof of_budget, "%gs-%gs", options_.budget, options_.base_seconds);
  options_.work /= of_budget;
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
    thin_out(scene_->test, options_.ground_truth);
  }
  return *scene_;
}

// Trains a field on images once; later calls and processes load it from the work folder.
nerf::RadianceField CellRunner::trained_field(const std::string& stem, const nerf::Dataset& images,
                                              const CellName& name, double seconds) {
  const auto path = options_.work / (stem + ".field"), checkpoint = options_.work / (stem + ".checkpoint");
  if (std::filesystem::exists(path)) return nerf::RadianceField::load(path);
  nerf::RadianceFieldOptions sizes = is_mlp(name) ? nerf::RadianceFieldOptions{} : options_.hash;
  if (is_mlp(name)) sizes.field.kind = nerf::FieldKind::mlp;
  sizes.seed = name.seed;
  nerf::RadianceField field(sizes);
  auto options = nerf::train_options(sizes.field.kind);
  options.schedule.seconds = seconds;
  options.seed = name.seed;
  nerf::Trainer trainer(field, images, options);
  timed_run(trainer, stem, seconds, checkpoint, options_.progress);
  field.save(path);
  std::filesystem::remove(checkpoint);
  return nerf::RadianceField::load(path);  // as a later process will load it
}

// Returns the unmarked field of a scene, shared by all systems of one seed.
nerf::RadianceField CellRunner::base_field(const CellName& name, const Scene& scene) {
  double seconds = options_.base_seconds;
  if (seconds <= 0) seconds = is_mlp(name) ? options_.budget : std::min(options_.budget, kHashSeconds);
  return trained_field("unmarked-" + name.scene + "-" + name.field + "-" + std::to_string(scene.size) + "-" +
                           std::to_string(name.seed),
                       scene.train, name, seconds);
}

// Trains the 2-D network, shared by the cells that mark training images and renders with it, and then two
// fields on marked training images: four fifths of the budget for the network, the rest for the fields.
CellRunner::Trained CellRunner::train_hiding(const CellName& name, const Scene& scene,
                                             const std::shared_ptr<const nerf::RadianceField>& unmarked) {
  const HidingSystem system = *hiding_system(name.system);
  auto options = hiding_train_options(system.kind);
  options.schedule.seconds = kNetworkPart * options_.budget;
  const auto marker = std::make_shared<ImageMarker>(
      system.kind, HidingOptions{.bits = name.bits, .channels = kNetworkChannels, .tile = options.crop},
      name.seed);
  const CropSource crops(images_of(scene.train), name.seed);
  options.seed = name.seed;
  HidingTrainer trainer(*marker, crops, options);
  Trained trained;
  trained.unmarked = unmarked;
  const std::string stem = std::string(hiding_name(system.kind)) + "-" + name.scene + "-" +
                           std::to_string(scene.size) + "-" + std::to_string(name.bits) + "-" +
                           std::to_string(name.seed);
  trained.seconds = timed_run(trainer, stem, options.schedule.seconds, options_.work / (stem + ".checkpoint"),
                              options_.progress);
  trained.curve = trainer.curve();
  trained.steps = trainer.steps();
  const OwnScores own =
      own_scores(*marker, CropSource(images_of(scene.test), name.seed), kOwnImages, kOwnSize, name.seed);
  trained.own_2d_accuracy = own.accuracy;
  trained.more = {{"own_2d_psnr", own.psnr},
                  {"trained_psnr", trainer.figures().mark_psnr},
                  {"network_seconds", trained.seconds}};
  if (system.renders) {
    trained.marked = marked_renders(marker, unmarked, name.seed);
    return trained;
  }
  const auto message = message_of_view(name.bits, name.seed, kFixedMessage);
  const double seconds = 0.5 * (1 - kNetworkPart) * options_.budget;
  const auto field_of = [&](const watermark::Message& sent, const char* which) {
    const nerf::Dataset marked = marked_images(scene.train, *marker, sent);
    trained.more["training_images_accuracy"] += 0.5 * accuracy_of(*marker, images_of(marked), sent);
    return std::make_shared<const nerf::RadianceField>(
        trained_field(name.stem() + which, marked, name, seconds));
  };
  trained.marked =
      marked_scene(marker, {field_of(message, "-one"), field_of(opposite(message), "-opposite")}, message);
  trained.seconds += 2 * seconds;
  return trained;
}

CellRunner::Trained CellRunner::train(const CellName& name, const Scene& scene) {
  const auto field = std::make_shared<const nerf::RadianceField>(base_field(name, scene));
  if (hiding_system(name.system)) return train_hiding(name, scene, field);
  const auto checkpoint = options_.work / (trained_as(name).stem() + ".checkpoint");
  const double views_a_second = is_mlp(name) ? kMlpViewsASecond : kViewsASecond;
  const auto views =
      std::clamp(static_cast<Index>(std::lround(views_a_second * options_.budget)), kFewestViews, kMostViews);
  TrainedOwner owned = train_owner(
      *field, name, owner_system(name, scene.size),
      {.seconds = options_.budget, .checkpoint = checkpoint, .views = views, .progress = options_.progress});
  Trained trained;
  trained.steps = owned.steps;
  trained.seconds = owned.seconds;
  trained.unmarked = field;
  trained.curve = owned.curve;
  trained.owner = std::make_shared<const TrainedOwner>(std::move(owned));
  trained.marked = marked_scene(*trained.owner, name.seed);
  return trained;
}

// Measures what single tables need from an owner: other points along the rays of an mlp field of 16 bits,
// noise on the weights at 8 bits, and the cameras of the authors' code for the preset that follows it.
void CellRunner::read_variants(const CellName& name, const Trained& trained,
                               std::map<std::string, double>& under) const {
  if (!trained.owner) return;
  const auto read = [&](const std::string& what, const MarkedScene& marked,
                        nerf::CameraSet cameras = nerf::CameraSet::novel) {
    if (!tell(name.stem() + ": " + what, 0, ""))
      throw Stopped(name.stem() + ": stopped while it was measured");
    under[what] = score_mark(*trained.unmarked, marked,
                             {.cameras = nerf::make_cameras(trained.unmarked->cameras, cameras,
                                                            std::max<Index>(1, options_.under_views), 0,
                                                            name.seed + kCamerasSeed)})
                      .accuracy;
  };
  if (name.bits == kWeightsBits) {
    TrainedOwner noisy = *trained.owner;
    noisy.owner = with_noisy_weights(noisy.owner, kWeightsNoise, name.seed);
    read("weights_0.01", marked_scene(noisy, name.seed));
  }
  if (name.system == "copyrnerf_code" && !trained.unmarked->cameras.forward_facing)
    read("cameras_ring", trained.marked, nerf::CameraSet::ring);
  if (!is_mlp(name) || name.bits != 16) return;
  const std::pair<const char*, nerf::RayPoints> kinds[] = {{"sampling_32_asp_32_isp", {32, 32, 0}},
                                                           {"sampling_64_asp", {64, 0, 0}},
                                                           {"sampling_32_asp", {32, 0, 0}},
                                                           {"sampling_16_asp", {16, 0, 0}},
                                                           {"sampling_64_rsp", {0, 0, 64}}};
  for (const auto& [what, points] : kinds)
    read(what, marked_scene(*trained.owner, name.seed, {.points = points}));
}

MeasuredCell CellRunner::run(const CellName& name) {
  paper_system(name.system);  // fails before a scene is read
  const Scene& data = scene(name);
  const Trained trained = train(name, data);
  const auto& o = options_;
  MarkScores s =
      score_mark(*trained.unmarked, trained.marked,
                 {.cameras = nerf::make_cameras(trained.unmarked->cameras, nerf::CameraSet::novel, o.views, 0,
                                                name.seed + kCamerasSeed),
                  .under = name.bits == 16 ? o.under : std::vector<std::string>{},
                  .under_views = o.under_views,
                  .seconds = o.budget,
                  .ground_truth = &data.test,
                  .seed = name.seed,
                  .lpips = o.lpips,
                  .progress = [&](double part) {
                    if (!tell(name.stem() + ": measure", part, ""))
                      throw Stopped(name.stem() + ": stopped while it was measured, its training is saved");
                    return true;
                  }});
  read_variants(name, trained, s.under);
  const nerf::Camera& camera = data.test.views.front().camera;
  const Tensor<float> pair[] = {nerf::Renderer(*trained.unmarked).render(camera).rgb,
                                trained.marked.render(camera, trained.marked.message(0))};
  std::map<std::string, double> more{{"views", static_cast<double>(s.views)},
                                     {"distorted_views", static_cast<double>(o.under_views)},
                                     {"test_images", static_cast<double>(data.test.views.size())},
                                     {"width", static_cast<double>(camera.width)},
                                     {"height", static_cast<double>(camera.height)},
                                     {"budget", o.budget},
                                     {"ssim_base", s.ssim_base},
                                     {"lpips_base", s.lpips_base},
                                     {"psnr_gt_foreground", s.psnr_gt_object},
                                     {"psnr_gt_unmarked", s.psnr_gt_unmarked}};
  more.insert(trained.more.begin(), trained.more.end());
  Cell cell{.name = name,
            .steps = trained.steps,
            .seconds = trained.seconds,
            .bit_accuracy = s.accuracy,
            .spread = s.spread,
            .own_2d_accuracy = trained.own_2d_accuracy,
            .psnr_base = s.psnr_base,
            .psnr_base_foreground = s.psnr_base_foreground,
            .psnr_gt = s.psnr_gt,
            .ssim = s.ssim_gt,
            .lpips = s.lpips_gt,
            .under = s.under,
            .commit = o.commit,
            .more = more};
  keep_curve(cell, trained.curve);
  return {.cell = cell, .image = tile(pair, 2, 0)};
}

}  // namespace fieldmark::baselines
