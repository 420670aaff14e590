#pragma once
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/mark/object_window.h>
#include <fieldmark/watermark/mark/view_cache.h>

#include <functional>
#include <optional>
#include <string_view>

namespace fieldmark::watermark {

/// Camera distances and image resolution of the views to embed in.
enum class EmbedDistances {
  novel,   ///< novel cameras, the object always at the extractor's size
  native,  ///< novel cameras, the object at no more pixels than it has in their images
  several  ///< native, but a quarter of the views closer and a quarter farther, see nerf::CameraSet
};
/// Returns "novel", "native" or "several".
const char* distances_name(EmbedDistances distances);
/// Parses a name.   @throws ValueError if it is none of these
EmbedDistances parse_distances(std::string_view name);

/// Returns the samples per ray, see cache_view(), whose sum a pixel's mark must be: one for objects, whose
/// surfaces are hard, and for forward-facing scenes; four where space is contracted. Rays of fox have 6.3
/// parts on average, in several cells: a mark learnt at their mean places was read blindly to 92.1%, one
/// learnt at four parts to 94.3% (48 bits, 60 new views, as embedded, 1,200 steps, one run each).
Index samples_for(nerf::SpaceKind space);

/// Returns true where views from all directions can be trained on: for an object, whose field is as reliable
/// from directions without training images as from others. docs/notes/embedding.md has what it gives and
/// costs.
bool all_directions_for(nerf::SpaceKind space);

/// Options for the views to embed in.
struct EmbedViewOptions {
  Index count = 200;                                 ///< views, >= 1
  Index samples = 0;                                 ///< per ray, see cache_view(); 0: samples_for()
  EmbedDistances distances = EmbedDistances::novel;  ///< of their cameras
  /// True: every second camera is of CameraSet::sphere, with several every fourth; default:
  /// all_directions_for().
  std::optional<bool> all_directions = {};
  /// True if all options are equal.
  bool operator==(const EmbedViewOptions&) const = default;
};

/// Renders and caches the views to embed in. Each is cut to the object's window, as for reading (see
/// object_window.h), with background where the window reaches beyond the image, and has the size of the
/// extractor's patch. With native and several, a view is smaller where an image of the field's size has fewer
/// pixels, but at least a quarter per side; the embedder enlarges it as for reading.
/// @param patch  see OwnerOptions::patch()
/// @param progress  called after each view with (done, total); returns false to stop, which throws Error
/// @throws ValueError as cache_view(), and for all_directions where all_directions_for() is false
std::vector<CachedView> cache_embed_views(const nerf::RadianceField& field, const PatchSize& patch,
                                          const EmbedViewOptions& options, std::uint64_t seed,
                                          const std::function<bool(Index, Index)>& progress = {});

/// Caches views of novel cameras with one sample per ray.
std::vector<CachedView> cache_novel_views(const nerf::RadianceField& field, const PatchSize& patch,
                                          Index count, std::uint64_t seed,
                                          const std::function<bool(Index, Index)>& progress = {});

/// Returns the effective number of cells that a view shows, in which slivers count little:
/// (sum a)^2 / sum a^2 over the cells' visible areas a; 0 if it shows nothing.
double cells_shown(const CachedView& view, Index side);
/// Returns the 10th percentile of cells_shown() over several views; 0 without views.
double cells_shown(std::span<const CachedView> views, Index side);

/// Returns the cells per axis at which one view shows the whole message: the least of 16, 22, 28 ... 64 at
/// which cells_shown() is at least two per bit, or 64 if none is; and at least 400, up to 40 per axis. Fewer
/// cells are easier to recognise; a bit that a view does not show cannot be read from it, and a part of a
/// view, or one of several pasted copies, shows too few of them to be proven. Where space is contracted,
/// images are crops of the scene and may be cropped again: at least eight per bit, so that two fifths of an
/// image still show three, and no more: most cells are far away.
/// @param bits  length of the message, at least 1   @param space  of the field
Index cells_for_message(std::span<const CachedView> views, Index bits, nerf::SpaceKind space);

}  // namespace fieldmark::watermark
