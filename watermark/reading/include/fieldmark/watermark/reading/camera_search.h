#pragma once
#include <fieldmark/watermark/mark/view_cache.h>
#include <fieldmark/watermark/reading/blind_reader.h>
#include <fieldmark/watermark/reading/summed_area.h>

namespace fieldmark::watermark {

/// How cameras are looked for.
struct CameraSearchOptions {
  Index views = 256;       ///< novel cameras to compare with, at least 1
  Index around = 192;      ///< more in every direction, of an object that has no surroundings (a cube), >= 0
  Index size = 40;         ///< longer side of their renders, pixels, at least 16
  std::uint64_t seed = 0;  ///< of the cameras and of the draws
};

/// Finds roughly from where an image shows an owner's field, in three ways, by small renders of the field
/// made once. Neither key nor message is looked at.
///   - By the places that the extractor recognised. For each render, pairs of places propose how it
///     would have to be turned, scaled and moved (Fischler and Bolles 1981), and the proposal that most
///     places agree with is kept; the best few cameras are then moved until cells lie where they were seen.
///   - By the image itself: its object's window, a square (see object_window.h), turned in steps of 15
///     degrees and brought to 24 pixels, is correlated with those of the renders. It needs no extractor, but
///     the whole object in the image or a field that fills it.
///   - By the image as a part of a render, where it was cut: it is correlated, upright, with windows
///     of several sizes all over the renders.
class CameraSearch {
 public:
  /// @param owner  of preset fast; must outlive this   @throws ValueError if it is of another preset, or an
  /// option is out of range
  explicit CameraSearch(const Owner& owner, const CameraSearchOptions& options = {});
  /// The likeliest cameras by places, best first, at most `count`; none if too few were recognised.
  /// @param places  of an image of height x width pixels
  std::vector<nerf::Camera> find(const SeenPlaces& places, Index height, Index width, Index count) const;
  /// The likeliest cameras by the image, best first, at most `count`, each from another render.
  /// @param image  [H, W, 3]
  std::vector<nerf::Camera> find(const Tensor<float>& image, Index count) const;
  /// The likeliest cameras of an image that was cut to a part, best first, at most `count`, each from
  /// another render.   @param image  [H, W, 3]
  std::vector<nerf::Camera> find_part(const Tensor<float>& image, Index count) const;

 private:
  struct SeenCell {
    double x, y;       // pixels of the small render
    nerf::Vec3 point;  // world: the middle of what the view shows of the cell
  };
  struct SmallView {
    nerf::Camera camera;
    std::vector<std::int32_t> of_cell;  // [cells] entry in seen, -1 where the view does not show it
    std::vector<SeenCell> seen;
    Window window;             // of the object in the small render
    std::vector<float> small;  // its content, see small_window()
    SummedArea area;           // of the whole small render
  };
  struct Match;
  struct Proposal;
  Proposal propose(const SmallView& view, std::size_t number, const std::vector<Match>& matches,
                   double tolerance) const;
  Proposal best_part(std::size_t number, std::span<const float> image, double height_to_width) const;
  nerf::Camera proposed(const Proposal& proposal, Index height, Index width) const;
  std::vector<nerf::Camera> best_cameras(std::vector<Proposal>& proposals, Index height, Index width,
                                         Index count) const;
  nerf::Camera fitted(const Proposal& proposal, const std::vector<Match>& matches, double tolerance,
                      Index height, Index width) const;

  const Owner& owner_;
  CameraSearchOptions options_;
  std::vector<SmallView> views_;
};

}  // namespace fieldmark::watermark
