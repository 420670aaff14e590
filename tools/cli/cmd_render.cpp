#include <fieldmark/engine/parallel.h>
#include <fieldmark/imaging/image.h>
#include <fieldmark/nerf/renderer.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>
#include <set>

#include <fieldmark/tools/results/sheet.h>
#include "cli/camera_path.h"
#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/counted.h"
#include "cli/depth_map.h"
#include "cli/images.h"
#include "cli/outputs.h"
#include "cli/precision.h"
#include "cli/scene_data.h"
#include "cli/supersampling.h"
#include "cli/view_output.h"

namespace fieldmark::cli {
namespace {

constexpr char kViewPrefix[] = "view_", kDepthEnd[] = "_depth.npy";

struct RenderArguments {
  std::string field, out, data;
  std::string split = "test", cameras = "novel", precision = "fp32";
  std::string against, sheet, path;
  bool cameras_given = false, fps_given = false, overwrite = false, alpha = false, depth = false;
  Index size = 0, supersampling = 0;
  std::optional<Index> count;
  double fps = 24;
  std::optional<Index> average, importance, random;
  bool video() const { return is_video_path(out); }
};

// Returns the samples per ray if any were given; the field's values fill in the rest.
std::optional<nerf::RayPoints> points_of(const RenderArguments& options, const nerf::RadianceField& field) {
  if (!options.average && !options.importance && !options.random) return {};
  if (!field.coarse)
    throw UsageError("--average, --importance, --random: only for fields trained with --preset mlp, which " +
                     options.field + " is not");
  nerf::RayPoints points = field.options().points;
  points.average = options.average.value_or(points.average);
  points.importance = options.importance.value_or(points.importance);
  points.random = options.random.value_or(points.random);
  if (points.first() == 0)
    throw UsageError("--average 0: needs --random N, because importance samples need others");
  return points;
}

struct NamedCamera {
  std::string name;
  nerf::Camera camera;
};

// Returns the cameras of --path, or else of --cameras.
std::vector<nerf::Camera> drawn_cameras(const RenderArguments& options, const nerf::CameraSpan& span,
                                        std::uint64_t seed) {
  if (options.path == "orbit") return orbit(span, options.count.value_or(120), options.size);
  if (!options.path.empty()) return read_camera_path(options.path, span, options.size);
  return nerf::make_cameras(span, nerf::parse_camera_set(options.cameras), options.count.value_or(10),
                            options.size, seed);
}

std::vector<NamedCamera> cameras_of(const RenderArguments& options, const nerf::RadianceField& field,
                                    Context& context) {
  std::vector<NamedCamera> cameras;
  if (!options.data.empty() || options.cameras == "test") {
    if (options.data.empty()) throw UsageError("--cameras test: needs --data DIR");
    const auto data = load_scene(options.data, {.split = options.split}, context);
    std::set<std::string> names;
    for (const auto& view : data.views) {
      if (!names.insert(view.name).second)
        throw IoError(options.data + ": expected views with names of their own, found two called '" +
                      view.name +
                      "', which would be written to one file; rename one, or render with --cameras");
      cameras.push_back({view.name, view.camera.scaled(options.size)});
    }
    return cameras;
  }
  for (const auto& camera : drawn_cameras(options, field.cameras, context.seed())) {
    char name[32];
    std::snprintf(name, sizeof name, "%s%03zu", kViewPrefix, cameras.size());
    cameras.push_back({name, camera});
  }
  return cameras;
}

// Writes the views of both fields side by side, for the first few cameras.
void write_sheet(const RenderArguments& options, nerf::Renderer& renderer,
                 const std::vector<NamedCamera>& cameras) {
  const auto other = nerf::RadianceField::load(options.against);
  nerf::Renderer against(other, {.supersampling = options.supersampling});
  std::vector<results::ImagePair> pairs;
  for (std::size_t i = 0; i < std::min<std::size_t>(cameras.size(), 4); ++i)
    pairs.push_back({against.render(cameras[i].camera).rgb, renderer.render(cameras[i].camera).rgb});
  write_png(options.sheet, results::comparison_sheet(pairs));
}

// --overwrite removes older views that this command named; others stay.
void clear_older_views(const RenderArguments& options, const std::vector<NamedCamera>& cameras,
                       Context& context) {
  std::vector<std::filesystem::path> older, others;
  for (const auto& path : images_of_other_runs(options.out, options.overwrite, "view_N.png")) {
    const std::string stem = path.stem().string();
    const bool ours = path.extension() == ".png" && stem.starts_with(kViewPrefix) &&
                      std::ranges::all_of(stem.substr(std::size(kViewPrefix) - 1), is_digit);
    (ours ? older : others).push_back(path);
  }
  for (auto path : older) {
    std::filesystem::remove(path);
    std::filesystem::remove(path.replace_filename(path.stem().string() + kDepthEnd));
  }
  for (const auto& [name, camera] : cameras) {
    std::erase(others, std::filesystem::path(options.out) / (name + ".png"));
    std::filesystem::remove(std::filesystem::path(options.out) / (name + kDepthEnd));
  }
  if (!others.empty())
    context.note(options.out +
                 ": images of other names stay beside the new views: " + std::to_string(others.size()));
}

void check_options(const RenderArguments& options) {
  if (options.fps_given && !options.video())
    throw UsageError("--fps: needs a video as --out, got " + options.out + "; name a file FILE.mp4");
  if (options.cameras_given && !options.data.empty() && options.cameras != "test")
    throw UsageError("--cameras " + options.cameras + ": --data has cameras of its own");
  if (options.cameras_given && options.cameras == "test" && options.split != "test")
    throw UsageError("--split " + options.split + ": --cameras test renders the test views; leave out one");
  if (options.count && !options.path.empty() && options.path != "orbit")
    throw UsageError("--count: --path " + options.path + " has cameras of its own");
  if (options.video() && (options.alpha || options.depth))
    throw UsageError("--alpha, --depth: need a folder as --out; " + options.out + " is a video");
  if (options.video() && options.overwrite)
    throw UsageError("--overwrite: for folders; a video replaces an earlier one");
  if (options.video() && options.sheet == options.out)
    throw UsageError("--sheet: must differ from --out, both are " + options.out);
}

// Frames of a video share one size.
void check_sizes(const RenderArguments& options, const std::vector<NamedCamera>& cameras) {
  const nerf::Camera& first = cameras.front().camera;
  for (const auto& [name, camera] : cameras)
    if (options.video() && (camera.width != first.width || camera.height != first.height))
      throw UsageError("--out " + options.out + ": frames of a video must have one size, " +
                       cameras.front().name + " has " + std::to_string(first.width) + "x" +
                       std::to_string(first.height) + ", " + name + " " + std::to_string(camera.width) + "x" +
                       std::to_string(camera.height) + "; name a folder");
}

// The files that were written, and the seconds that rendering took.
struct Written {
  Json images = Json::array(), depth = Json::array();
  double seconds = 0;
};

Written write_views(const RenderArguments& options, const nerf::RadianceField& field,
                    nerf::Renderer& renderer, const std::vector<NamedCamera>& cameras, ViewOutput& output,
                    Context& context) {
  const InterruptGuard guard;
  Written written;
  std::size_t done = 0;
  Progress progress = context.progress("render");
  for (const auto& [name, camera] : cameras) {
    if (guard.interrupted()) {
      if (options.video()) throw Interrupted("nothing was written");
      output.finish();
      throw Interrupted(counted(std::ssize(written.images), "view") + " written");
    }
    const double begin = context.seconds();
    auto rendering = renderer.render(camera);
    std::optional<Tensor<float>> depth;
    if (options.depth) depth = depth_map(field, renderer, camera, rendering.opacity);
    written.seconds += context.seconds() - begin;
    if (depth) {
      written.depth.push_back((std::filesystem::path(options.out) / (name + kDepthEnd)).string());
      write_npy(written.depth.back().get<std::string>(), *depth);
    }
    const auto path =
        output.add(name, options.alpha ? with_alpha(rendering, field.background) : std::move(rendering.rgb));
    if (!options.video() || done == 0) written.images.push_back(path.string());
    progress.update(static_cast<double>(++done) / static_cast<double>(cameras.size()));
  }
  output.finish();
  return written;
}

int run_render(const RenderArguments& options, Context& context) {
  check_options(options);
  if (!options.sheet.empty()) check_writable_page(options.sheet);
  const auto field = nerf::RadianceField::load(options.field);
  const auto cameras = cameras_of(options, field, context);
  nerf::Renderer renderer(field, {.precision = precision_of(options.precision),
                                  .points = points_of(options, field),
                                  .supersampling = options.supersampling});
  check_sizes(options, cameras);
  if (options.video()) check_writable_page(options.out);
  const nerf::Camera& first = cameras.front().camera;
  ViewOutput output(options.out, first.width, first.height, options.fps);
  if (!options.video()) {
    prepare_folder(options.out);
    clear_older_views(options, cameras, context);  // after everything that may be refused
  }
  const Written written = write_views(options, field, renderer, cameras, output, context);
  if (!options.sheet.empty()) write_sheet(options, renderer, cameras);
  const double each = written.seconds / static_cast<double>(cameras.size());
  char time[40];
  std::snprintf(time, sizeof time, ", %.3f s each", each);
  context.text() << options.out << ": " << counted(std::ssize(cameras), "view") << time << "\n";
  Json result = {{"views", cameras.size()},
                 {"width", first.width},
                 {"height", first.height},
                 {"seconds_per_view", each},
                 {"images", written.images}};
  if (options.depth) result["depth"] = written.depth;
  context.result(result);
  return kOk;
}

}  // namespace

Command add_render(CommandLine& app) {
  auto o = std::make_shared<RenderArguments>();
  app.add_option("--field", o->field, "Field to render")->required()->type_name("FIELD");
  app.add_option("--out", o->out, "Folder for the views, one PNG each, or one .mp4 file")
      ->required()
      ->type_name("DIR|FILE");
  Option data = app.add_option("--data", o->data, "Data set whose cameras to use")->type_name("DIR");
  app.add_option("--split", o->split, "Part of the data set: train, val, test")
      ->one_of({"train", "val", "test"})
      ->needs(data)
      ->type_name("SPLIT");
  const Option cameras =
      app.add_option(
             "--cameras", o->cameras,
             "Cameras to render from: novel (from the span of the training cameras), "
             "ring (elevation 30 degrees, radius 4.0311 units of the scene), sphere (all directions), "
             "extrapolated (over 30 degrees from every training direction where there are any), "
             "closer and farther (as novel, at other distances), test (of --data)")
          ->one_of(nerf::camera_set_names())
          ->type_name("SET");
  app.add_flag("--overwrite", o->overwrite,
               "Write to a folder that has images, and remove the views of earlier runs, view_N.png, "
               "with their depth");
  add_precision(app, o->precision);
  add_supersampling(app, o->supersampling);
  app.add_option("--count", o->count, "Cameras to draw, 1 to 100000; default: 10, or 120 along an orbit")
      ->range(1, 100000)
      ->excludes(data)
      ->type_name("N")
      ->default_str("");
  app.add_option("--path", o->path,
                 "Cameras along a path: orbit (around the scene, at the height of the training cameras), "
                 "or a JSON file with the keys of transforms.json")
      ->excludes(data)
      ->excludes(cameras)
      ->type_name("FILE|orbit");
  const Option fps = app.add_option("--fps", o->fps, "Frames per second of a video, 1 to 240")
                         ->range(1.0, 240.0)
                         ->type_name("N");
  app.add_flag("--alpha", o->alpha, "Keep the opacity as a fourth channel instead of a background");
  app.add_flag("--depth", o->depth,
               "Also write NAME_depth.npy: distance along the viewing direction in units of the scene, "
               "NaN where the opacity is below 1/2");
  app.add_option("--size", o->size, "Longer side of the images in pixels, 1 to 8192; default: as trained")
      ->range(1, 8192)
      ->type_name("N")
      ->default_str("");
  const auto points = [&](const char* name, std::optional<Index>& count, const char* what) {
    app.add_option(
           name, count,
           std::string(what) + " samples per ray, 0 to 1024; default: as trained; for fields of preset mlp")
        ->range(0, 1024)
        ->type_name("N")
        ->default_str("");
  };
  points("--average", o->average, "Average");
  points("--importance", o->importance, "Importance");
  points("--random", o->random, "Random");
  Option against =
      app.add_option("--against", o->against, "Field to compare with in --sheet")->type_name("FIELD");
  Option sheet = app.add_option("--sheet", o->sheet,
                                "PNG to write, four views of both fields and ten times their difference")
                     ->type_name("FILE");
  against->needs(sheet);
  sheet->needs(against);
  return [o, cameras, fps](Context& context) {
    o->cameras_given = cameras.count() > 0;
    o->fps_given = fps.count() > 0;
    return run_render(*o, context);
  };
}

}  // namespace fieldmark::cli
