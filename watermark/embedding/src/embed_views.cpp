#include <fieldmark/core/error.h>
#include <fieldmark/watermark/embedding/embed_views.h>
#include <fieldmark/watermark/mark/object_window.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace fieldmark::watermark {
namespace {
constexpr Index kWindowSize = 160;    // pixels of the small render that locates the object
constexpr Index kMlpWindowSize = 80;  // for an mlp field: larger renders would take longer than the views
constexpr Index kCoarsest = 4;        // side of the patch over the smallest side of a view
constexpr Index kParts = 4;           // per ray where it passes through more than a surface
constexpr Index kFewestCells = 16, kMostCells = 64, kMoreCells = 6;
constexpr double kCellsABit = 2, kCellsABitOfACut = 8, kPoorViews = 0.1;
// Of 60 recipients whose cells were pasted from three copies, two were not traced with 277, one with 323.
constexpr double kLeastCells = 400;
constexpr Index kFineForProof = 40;  // cells per axis beyond which only the message makes them finer

std::vector<nerf::Camera> cameras_of(const nerf::CameraSpan& span, const EmbedViewOptions& options,
                                     bool all_directions, Index size, std::uint64_t seed) {
  const auto draw = [&](nerf::CameraSet set) {
    return nerf::make_cameras(span, set, options.count, size, seed);
  };
  std::vector<nerf::Camera> cameras = draw(nerf::CameraSet::novel);
  if (all_directions) {
    const auto around = draw(nerf::CameraSet::sphere);
    const std::size_t every = options.distances == EmbedDistances::several ? 4 : 2;
    for (std::size_t i = 0; i < cameras.size(); i += every) cameras[i] = around[i];
  }
  if (options.distances == EmbedDistances::several) {
    const auto closer = draw(nerf::CameraSet::closer), farther = draw(nerf::CameraSet::farther);
    for (std::size_t i = 1; i < cameras.size(); i += 2) cameras[i] = i % 4 == 1 ? closer[i] : farther[i];
  }
  return cameras;
}

// Pads a view with background to a larger one, from a given pixel.
CachedView with_background(CachedView view, Index left, Index top, const PatchSize& size, float background) {
  const Index height = view.height, width = view.width;
  if (height == size.height && width == size.width) return view;
  const Tensor<float> base = std::move(view.base), opacity = std::move(view.opacity);
  const std::vector<std::int32_t> begin = std::move(view.sample_begin);
  view.height = size.height;
  view.width = size.width;
  view.base = Tensor<float>({size.height, size.width, 3}, background);
  view.opacity = Tensor<float>({size.height, size.width});
  view.sample_begin = {0};
  for (Index y = 0; y < size.height; ++y)
    for (Index x = 0; x < size.width; ++x) {
      std::int32_t samples = 0;
      if (x >= left && x < left + width && y >= top && y < top + height) {
        const Index from = (y - top) * width + x - left, to = y * size.width + x;
        const auto here = begin.begin() + from;
        samples = here[1] - here[0];
        std::copy_n(&base[3 * from], 3, &view.base[3 * to]);
        view.opacity[to] = opacity[from];
      }
      view.sample_begin.push_back(view.sample_begin.back() + samples);
    }
  return view;
}

// Renders the window's view as it is read: background where the window reaches beyond the image.
CachedView view_of_window(nerf::Renderer& renderer, const nerf::RadianceField& field,
                          const nerf::Camera& image, const Window& window, const PatchSize& size,
                          Index samples) {
  const nerf::Camera camera = window_camera(image, window, size);
  // Returns the first pixel whose centre is not before an offset from the window's edge.
  const auto first = [](double offset, double extent, Index pixels) {
    const double place = offset * static_cast<double>(pixels) / extent - 0.5;
    return std::clamp<Index>(static_cast<Index>(std::ceil(place)), 0, pixels);
  };
  const auto column = [&](Index x) {
    return first(static_cast<double>(x) - window.x, window.width, size.width);
  };
  const auto row = [&](Index y) {
    return first(static_cast<double>(y) - window.y, window.height, size.height);
  };
  const Index left = column(0), right = column(image.width), top = row(0), bottom = row(image.height);
  nerf::Camera inside = camera;
  inside.cx -= static_cast<double>(left);
  inside.cy -= static_cast<double>(top);
  inside.width = right - left;
  inside.height = bottom - top;
  CachedView view = with_background(cache_view(renderer, field, inside, samples), left, top, size,
                                    nerf::background_value(field.background));
  view.camera = camera;
  return view;
}

}  // namespace

const char* distances_name(EmbedDistances distances) {
  if (distances == EmbedDistances::novel) return "novel";
  return distances == EmbedDistances::native ? "native" : "several";
}

EmbedDistances parse_distances(std::string_view name) {
  for (const auto d : {EmbedDistances::novel, EmbedDistances::native, EmbedDistances::several})
    if (name == distances_name(d)) return d;
  throw ValueError("[embed_views] distances must be novel, native or several, got \"" + std::string(name) +
                   "\"");
}

Index samples_for(nerf::SpaceKind space) { return space == nerf::SpaceKind::contracted ? kParts : 1; }

bool all_directions_for(nerf::SpaceKind space) { return space == nerf::SpaceKind::cube; }

std::vector<CachedView> cache_embed_views(const nerf::RadianceField& field, const PatchSize& patch,
                                          const EmbedViewOptions& options, std::uint64_t seed,
                                          const std::function<bool(Index, Index)>& progress) {
  const bool all_directions = options.all_directions.value_or(all_directions_for(field.space.kind));
  if (all_directions && !all_directions_for(field.space.kind))
    throw ValueError(
        "[embed_views] all_directions must be false unless the field's space is cube (away from the "
        "training cameras, others are blurred), got space " +
        nerf::name_of(field.space.kind));
  // Renders at the training sample spacing: quick images for locating the object.
  nerf::Renderer renderer(field, {.finer = 1, .supersampling = 1});
  const float background = nerf::background_value(field.background);
  const Index own = std::max(field.cameras.width, field.cameras.height);  // pixels of the field's images
  std::vector<CachedView> views;
  const Index seen = field.coarse ? kMlpWindowSize : kWindowSize;
  const Index samples = options.samples > 0 ? options.samples : samples_for(field.space.kind);
  for (const nerf::Camera& camera : cameras_of(field.cameras, options, all_directions, seen, seed)) {
    const Window window = object_window(renderer.render(camera).rgb, background, patch.aspect());
    PatchSize size = patch;
    if (options.distances != EmbedDistances::novel) {
      size.height =
          std::clamp<Index>(std::lround(window.height * static_cast<double>(own) / static_cast<double>(seen)),
                            (patch.height + kCoarsest - 1) / kCoarsest, patch.height);
      size.width = std::lround(static_cast<double>(size.height) * patch.aspect());
    }
    views.push_back(view_of_window(renderer, field, camera, window, size, samples));
    if (progress && !progress(static_cast<Index>(views.size()), options.count))
      throw Error("stopped while views were cached");
  }
  return views;
}

std::vector<CachedView> cache_novel_views(const nerf::RadianceField& field, const PatchSize& patch,
                                          Index count, std::uint64_t seed,
                                          const std::function<bool(Index, Index)>& progress) {
  return cache_embed_views(field, patch, {.count = count, .samples = 1, .all_directions = false}, seed,
                           progress);
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
  const auto n = static_cast<double>(bits);
  const bool cut = space == nerf::SpaceKind::contracted;
  const double for_message = (cut ? kCellsABitOfACut : kCellsABit) * n, for_proof = cut ? 0 : kLeastCells;
  Index side = kFewestCells;
  for (; side < kMostCells; side += kMoreCells) {
    const double shown = cells_shown(views, side);
    if (shown >= for_message && (shown >= for_proof || side >= kFineForProof)) break;
  }
  return side;
}

}  // namespace fieldmark::watermark
