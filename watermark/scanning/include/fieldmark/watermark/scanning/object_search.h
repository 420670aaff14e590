#pragma once
#include <fieldmark/watermark/mark/object_window.h>
#include <fieldmark/watermark/mark/owner.h>
#include <fieldmark/watermark/scanning/image_blocks.h>

#include <vector>

namespace fieldmark::watermark {

/// Where a part of an object may be in an image.
struct ObjectPlace {
  nerf::Camera camera;   ///< of the whole image, under which the object would be seen there
  Window window{};       ///< around the part, pixels of the image
  bool whole = true;     ///< false for a quarter of the object
  double likeness = -1;  ///< correlation of colours within the part's outline, in [-1, 1]
};

/// Options of ObjectSearch.
struct ObjectSearchOptions {
  Index views = 256;       ///< novel cameras to compare with, at least 1
  Index size = 96;         ///< longer side of their renders, pixels, at least 24
  std::uint64_t seed = 0;  ///< of the cameras
};

/// Finds an object, or a quarter of it, before any background. Renders of the field are cut out along their
/// outlines, whole and in eight quarters: four divide the object's window equally, four its pixels. Each part
/// is compared with every place of the image at eight sizes, on a coarse grid. The best 64 wholes and 512
/// quarters are compared again on a fine grid, at five sizes and 49 places around each. The likeness of a
/// part T with the image I, over the n pixels of the part's outline and all channels c:
///   sum (T_c - mean T_c) I_c / sqrt(sum (T_c - mean T_c)^2 sum (I_c - mean I_c)^2)
/// so a gain and an offset do not count. The search knows neither key nor message. It finds upright objects
/// alone.
class ObjectSearch {
 public:
  /// Renders the views. @param owner  of an object
  /// @throws ValueError if the field fills its images, or as check()
  explicit ObjectSearch(const Owner& owner, const ObjectSearchOptions& options = {});
  ~ObjectSearch();
  /// @throws ValueError if an option is out of range
  static void check(const ObjectSearchOptions& options);
  /// Places of one kind to return.
  struct Wanted {
    Index count = 0;  ///< most places, at least 0
    Index least = 0;  ///< longer side of the smallest one, pixels, at least 0
  };
  /// Returns places of the whole object, then of quarters, each kind by falling likeness. A view appears at
  /// most once per kind. They do not depend on the number of threads.
  /// @param rgb  [H, W, 3], sides of at least 16   @throws ShapeError for another shape
  /// @throws ValueError if a count or a side is negative
  std::vector<ObjectPlace> find(const Tensor<float>& rgb, const Wanted& wholes, const Wanted& quarters) const;

 private:
  struct Part;
  struct Found;
  class Sizes;
  void add_part(std::size_t view, const Tensor<float>& rgb, const Tensor<float>& opacity,
                const Window& window, bool whole);
  std::vector<Found> found(const Tensor<float>& rgb, bool whole, Index least) const;
  nerf::Camera camera_at(const Part& part, const Window& window, Index height, Index width) const;

  std::vector<nerf::Camera> cameras_;
  std::vector<Part> parts_;
};

}  // namespace fieldmark::watermark
