#pragma once
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/mark/object_window.h>
#include <fieldmark/watermark/mark/view_cache.h>

#include <functional>
#include <string_view>

namespace fieldmark::watermark {

/// Where the cameras of the views to embed in stand, and how fine their images are.
enum class EmbedDistances {
  novel,   ///< novel cameras, the object always at the reader's size
  native,  ///< novel cameras, the object with no more pixels than their images would have of it
  several  ///< native, but a quarter of the views closer and a quarter farther, see nerf::CameraSet
};
/// "novel", "native" or "several".
const char* distances_name(EmbedDistances distances);
/// @throws ValueError if the name is none of these
EmbedDistances parse_distances(std::string_view name);

/// Samples of a ray, see cache_view(), that the mark of a pixel has to be the sum of: one of an object's,
/// whose surfaces are hard, and of forward-facing scenes, four where space is contracted. Rays of fox
/// have 6.3 parts on average, in several cells: learnt from marks at their mean places, images of it were
/// read to 92.1% blindly, from four parts to 94.3% (48 bits, 60 new views, as embedded, 1,200 steps, one run
/// each).
Index samples_for(nerf::SpaceKind space);

/// The views to embed in.
struct EmbedViewOptions {
  Index count = 200;                                 ///< of them, >= 1
  Index samples = 0;                                 ///< kept of a ray, see cache_view(); 0: samples_for()
  EmbedDistances distances = EmbedDistances::novel;  ///< of their cameras
};

/// Renders and caches the views to embed in, each cut to the object's window as the reader will cut an image
/// (see object_window.h), with background where the window reaches beyond it, as large as the extractor's
/// patch; from native on smaller where an image of the field's size has fewer pixels, though no less than a
/// quarter a side: the embedder enlarges those as the reader would.
/// @param patch  see OwnerOptions::patch()
/// @param progress  called after each view with (done, total); returns false to stop, which throws Error
/// @throws ValueError as cache_view()
std::vector<CachedView> cache_embed_views(const nerf::RadianceField& field, const PatchSize& patch,
                                          const EmbedViewOptions& options, std::uint64_t seed,
                                          const std::function<bool(Index, Index)>& progress = {});

/// The same of novel cameras, with one sample of a ray.
std::vector<CachedView> cache_novel_views(const nerf::RadianceField& field, const PatchSize& patch,
                                          Index count, std::uint64_t seed,
                                          const std::function<bool(Index, Index)>& progress = {});

/// How many cells a view shows, of which slivers count little: (sum a)^2 / sum a^2 over the cells' visible
/// areas a; 0 if it shows nothing.
double cells_shown(const CachedView& view, Index side);
/// The 10th percentile of cells_shown() over several views; 0 without views.
double cells_shown(std::span<const CachedView> views, Index side);

/// Cells an axis so that one view shows the whole message: the least of 16, 22, 28 ... 64 at which
/// cells_shown() is two or more for each bit, or 64 if none is. Fewer are easier to recognise; a bit that a
/// view does not show cannot be read from it. Images of a scene without bounds are cuts of it, and may be
/// cut again: eight or more for each bit, so that two in five of an image still show three.
/// @param bits  length of the message, at least 1   @param space  of the field
Index cells_for_message(std::span<const CachedView> views, Index bits, nerf::SpaceKind space);

}  // namespace fieldmark::watermark
