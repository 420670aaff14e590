#include <fieldmark/watermark/embed_views.h>
#include <fieldmark/watermark/object_window.h>

namespace fieldmark::watermark {
namespace {
constexpr Index kWindowSize = 160;  // pixels of the small picture that shows where the object is
}

std::vector<CachedView> cache_near_views(const nerf::RadianceField& field, Index reader_size, Index count,
                                         std::uint64_t seed,
                                         const std::function<bool(Index, Index)>& progress) {
  nerf::Renderer renderer(field, {.finer = 1});  // the samples the field was trained with
  const float background = nerf::background_value(field.background);
  std::vector<CachedView> views;
  for (const nerf::Camera& camera :
       nerf::make_cameras(field.cameras, nerf::CameraSet::near, count, kWindowSize, seed)) {
    const Window window = object_window(renderer.render(camera).rgb, background);
    views.push_back(cache_view(renderer, field, window_camera(camera, window, reader_size)));
    if (progress && !progress(static_cast<Index>(views.size()), count))
      throw Error("stopped while views were cached");
  }
  return views;
}

std::vector<double> visible_area(std::span<const CachedView> views, Index side) {
  std::vector<double> area(static_cast<std::size_t>(side * side * side));
  for (const CachedView& view : views)
    for (std::size_t k = 0; k < view.weight.size(); ++k)
      area[static_cast<std::size_t>(CellGrid::place(side, &view.position[3 * k]))] +=
          static_cast<double>(view.weight[k]);
  return area;
}

}  // namespace fieldmark::watermark
