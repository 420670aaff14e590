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
  Index size = 64;         ///< longer side of their renders, pixels, at least 16
  std::uint64_t seed = 0;  ///< of the cameras
};

/// Finds an object, or a quarter of it, before any background. Renders of the field, cut out along their
/// outlines, are compared with every place of the image at eight sizes. The likeness of a part T with the
/// image I, over the n pixels of the part's outline and all channels c:
///   sum (T_c - mean T_c) I_c / sqrt(sum (T_c - mean T_c)^2 sum (I_c - mean I_c)^2)
/// so a gain and an offset do not count. The search knows neither key nor message. It finds upright objects
/// alone.
class ObjectSearch {
 public:
  /// Renders the views. @param owner  of an object
  /// @throws ValueError if the field fills its images, or as check()
  explicit ObjectSearch(const Owner& owner, const ObjectSearchOptions& options = {});
  /// @throws ValueError if an option is out of range
  static void check(const ObjectSearchOptions& options);
  /// Returns at most `count` places of the whole object, then as many of quarters, the best of each first and
  /// from another view. They do not depend on the number of threads.
  /// @param rgb  [H, W, 3], sides of at least 16   @throws ShapeError for another shape
  std::vector<ObjectPlace> find(const Tensor<float>& rgb, Index count) const;

 private:
  struct Part {
    std::size_t view;
    bool whole;
    Window window;                  // in the render
    Index height, width;            // of the grid
    std::vector<Index> y, x;        // of the outline's pixels in the grid
    std::vector<float> of_mean[3];  // their colours without the mean, unit length over all channels
  };
  struct Reduced;
  void add_part(std::size_t view, const Tensor<float>& rgb, const Tensor<float>& opacity,
                const Window& window, bool whole);
  nerf::Camera camera_at(const Part& part, const Window& window, Index height, Index width) const;
  static std::vector<Reduced> reduced(const Tensor<float>& rgb, bool whole);
  static ObjectPlace best_place(const Part& part, const Reduced& image);

  std::vector<nerf::Camera> cameras_;
  std::vector<Part> parts_;
};

}  // namespace fieldmark::watermark
