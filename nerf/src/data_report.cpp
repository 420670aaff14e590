#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/nerf/data_report.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "data_files.h"
#include "odd_cameras.h"
#include "vec3.h"

namespace fieldmark::nerf {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

// Lists the splits. If val and test share their images, test is read.
std::vector<SplitReport> splits_of(const DataFiles& files) {
  std::vector<SplitReport> splits;
  for (std::size_t s = 0; s < files.splits.size(); ++s) {
    const DataFiles::Split& split = files.splits[s];
    splits.push_back(
        {.split = split.split, .images = std::ssize(split.files), .missing = std::ssize(split.missing)});
    if (split.split == "train") continue;
    for (std::size_t other = s + 1; other < files.splits.size(); ++other)
      if (!split.files.empty() && split.files == files.splits[other].files)
        splits[s].same_as = files.splits[other].split;
  }
  return splits;
}

std::vector<ImageSize> sizes_of(const std::vector<SurveyedView>& views) {
  std::map<std::pair<Index, Index>, Index> counts;
  for (const SurveyedView& v : views) ++counts[{v.width, v.height}];
  std::vector<ImageSize> sizes;
  for (const auto& [size, count] : counts) sizes.push_back({size.first, size.second, count});
  std::ranges::stable_sort(sizes, std::ranges::greater{}, &ImageSize::count);
  return sizes;
}

double angle_between(const Vec3& a, const Vec3& b) { return std::acos(std::clamp(dot(a, b), -1., 1.)); }

// @param centre  of the scene, if its type defines one
void describe_cameras(const std::vector<SurveyedView>& views, const std::optional<Vec3>& centre,
                      DataReport& report) {
  const std::vector<bool> far = outlying(views);
  report.centre = centre.value_or(views.front().camera.position());
  if (const auto span = span_without(views, far)) {
    report.up = span->up;
    if (!centre) report.centre = span->centre;
  }
  std::vector<double> distances;
  std::vector<Vec3> directions;
  report.fields_of_view = {180, 0};
  for (std::size_t i = 0; i < views.size(); ++i) {
    const SurveyedView& v = views[i];
    report.cameras.push_back({.name = v.name, .split = v.split, .camera = v.camera, .outlying = far[i]});
    const Vec3 from = v.camera.position() - report.centre;
    distances.push_back(norm(from));
    if (distances.back() > 0) directions.push_back(normalised(from));
    const double view = 2 * std::atan(0.5 * static_cast<double>(v.camera.width) / v.camera.fx) * kDegrees;
    report.fields_of_view[0] = std::min(report.fields_of_view[0], view);
    report.fields_of_view[1] = std::max(report.fields_of_view[1], view);
  }
  for (const Vec3& a : directions)
    for (const Vec3& b : directions) report.spread = std::max(report.spread, angle_between(a, b) * kDegrees);
  std::ranges::sort(distances);
  report.distances = {distances.front(), distances[distances.size() / 2], distances.back()};
}

// What is known about a data set while its splits are read.
struct Examination {
  DataReport report{};
  std::vector<SurveyedView> views{};
  std::size_t train = 0;         // of these views, at the beginning
  std::optional<Vec3> centre{};  // of a forward-facing scene
};

void take_in(const Dataset& data, Examination& e) {
  DataReport& report = e.report;
  if (data.split == "train") {
    report.name = data.name, report.layout = data.layout, report.scene = data.scene;
    report.scene_reason = data.scene_reason, report.background = data.background;
    if (data.scene == SceneType::forward) e.centre = camera_span(data).centre;
  }
  for (const std::string& note : data.notes)
    if (std::ranges::find(report.notes, note) == report.notes.end()) report.notes.push_back(note);
  for (SurveyedView& v : survey_views(data)) {
    report.masked_images += v.valid < 1;
    e.views.push_back(std::move(v));
  }
  if (data.split == "train") e.train = e.views.size();
}

}  // namespace

DataReport report_data(const std::filesystem::path& folder, const DatasetOptions& options,
                       const std::function<bool(double)>& progress) {
  const DataFiles files = list_files(folder, options.size);
  Examination e{.report = {.splits = splits_of(files)}};
  double all = 0, read = 0;
  for (const SplitReport& split : e.report.splits)
    if (split.same_as.empty()) all += static_cast<double>(split.images);
  DatasetOptions wanted = options;
  wanted.most_views = 0;
  // Training images come first: they determine the type of the scene.
  const auto take_in_split = [&](const std::string& split, Index images) {
    wanted.split = split;
    const Dataset data = load_dataset(folder, wanted);
    wanted.scene = data.scene, wanted.background = data.background;
    take_in(data, e);
    read += static_cast<double>(images);
    return !progress || progress(read / all);
  };
  const auto splits = e.report.splits;
  if (!take_in_split("train", splits.front().images)) return std::move(e.report);
  for (const SplitReport& split : splits)
    if (split.split != "train" && split.images > 0 && split.same_as.empty() &&
        !take_in_split(split.split, split.images))
      return std::move(e.report);
  DataReport& report = e.report;
  report.sizes = sizes_of(e.views);
  describe_cameras(e.views, e.centre, report);
  const std::span all_views(e.views), train = all_views.first(e.train);
  report.oddities = odd_views(all_views, report.scene);
  for (auto& more : {twins(train, all_views.subspan(e.train)), odd_files(folder, options.size)})
    report.oddities.insert(report.oddities.end(), more.begin(), more.end());
  return std::move(e.report);
}

std::string name_of(Layout layout) {
  const std::array names{"blender", "transforms", "llff", "colmap"};
  return names[static_cast<std::size_t>(layout)];
}

}  // namespace fieldmark::nerf
