#include <fieldmark/engine/error.h>
#include <fieldmark/watermark/embed_views.h>
#include <fieldmark/watermark/object_window.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {
constexpr Index kWindowSize = 160;    // pixels of the small picture that shows where the object is
constexpr Index kMlpWindowSize = 80;  // of an mlp field, where larger ones would take longer than the views
constexpr Index kCoarsest = 4;        // the reader's size over the least of a view
constexpr Index kFewestCells = 16, kMostCells = 64, kMoreCells = 6;
constexpr double kCellsABit = 2, kCellsABitOfACut = 8, kPoorViews = 0.1;

std::vector<nerf::Camera> cameras_of(const nerf::CameraSpan& span, const EmbedViewOptions& options,
                                     Index size, std::uint64_t seed) {
  const auto draw = [&](nerf::CameraSet set) {
    return nerf::make_cameras(span, set, options.count, size, seed);
  };
  std::vector<nerf::Camera> cameras = draw(nerf::CameraSet::near);
  if (options.distances != EmbedDistances::several) return cameras;
  const auto closer = draw(nerf::CameraSet::closer), farther = draw(nerf::CameraSet::farther);
  for (std::size_t i = 1; i < cameras.size(); i += 2) cameras[i] = i % 4 == 1 ? closer[i] : farther[i];
  return cameras;
}

}  // namespace

const char* distances_name(EmbedDistances distances) {
  if (distances == EmbedDistances::near) return "near";
  return distances == EmbedDistances::native ? "native" : "several";
}

EmbedDistances parse_distances(std::string_view name) {
  for (const auto d : {EmbedDistances::near, EmbedDistances::native, EmbedDistances::several})
    if (name == distances_name(d)) return d;
  throw ValueError("[embed_views] distances must be near, native or several, got \"" + std::string(name) +
                   "\"");
}

std::vector<CachedView> cache_embed_views(const nerf::RadianceField& field, Index reader_size,
                                          const EmbedViewOptions& options, std::uint64_t seed,
                                          const std::function<bool(Index, Index)>& progress) {
  // The samples the field was trained with: quick pictures to find the object in.
  nerf::Renderer renderer(field, {.finer = 1, .supersampling = 1});
  const float background = nerf::background_value(field.background);
  const Index own = std::max(field.cameras.width, field.cameras.height);  // pixels of its pictures
  std::vector<CachedView> views;
  const Index seen = field.coarse ? kMlpWindowSize : kWindowSize;
  for (const nerf::Camera& camera : cameras_of(field.cameras, options, seen, seed)) {
    const Window window = object_window(renderer.render(camera).rgb, background);
    Index size = reader_size;
    if (options.distances != EmbedDistances::near)
      size =
          std::clamp<Index>(std::lround(window.side * static_cast<double>(own) / static_cast<double>(seen)),
                            (reader_size + kCoarsest - 1) / kCoarsest, reader_size);
    views.push_back(cache_view(renderer, field, window_camera(camera, window, size), options.samples));
    if (progress && !progress(static_cast<Index>(views.size()), options.count))
      throw Error("stopped while views were cached");
  }
  return views;
}

std::vector<CachedView> cache_near_views(const nerf::RadianceField& field, Index reader_size, Index count,
                                         std::uint64_t seed,
                                         const std::function<bool(Index, Index)>& progress) {
  return cache_embed_views(field, reader_size, {.count = count}, seed, progress);
}

std::vector<double> visible_area(std::span<const CachedView> views, Index side) {
  std::vector<double> area(static_cast<std::size_t>(side * side * side));
  for (const CachedView& view : views)
    for (std::size_t k = 0; k < view.weight.size(); ++k)
      area[static_cast<std::size_t>(CellGrid::place(side, &view.position[3 * k]))] +=
          static_cast<double>(view.weight[k]);
  return area;
}

double cells_shown(const CachedView& view, Index side) {
  double sum = 0, squares = 0;
  for (const double a : visible_area({&view, 1}, side)) {
    sum += a;
    squares += a * a;
  }
  return squares > 0 ? sum * sum / squares : 0;
}

double cells_shown(std::span<const CachedView> views, Index side) {
  if (views.empty()) return 0;
  std::vector<double> shown;
  for (const CachedView& view : views) shown.push_back(cells_shown(view, side));
  const auto poor =
      shown.begin() + static_cast<std::ptrdiff_t>(kPoorViews * static_cast<double>(shown.size()));
  std::nth_element(shown.begin(), poor, shown.end());
  return *poor;
}

Index cells_for_message(std::span<const CachedView> views, Index bits, nerf::SpaceKind space) {
  const double least =
      (space == nerf::SpaceKind::contracted ? kCellsABitOfACut : kCellsABit) * static_cast<double>(bits);
  Index side = kFewestCells;
  while (side < kMostCells && cells_shown(views, side) < least) side += kMoreCells;
  return side;
}

}  // namespace fieldmark::watermark
