#pragma once
#include <fieldmark/watermark/mark/view_cache.h>
#include <fieldmark/watermark/reading/informed_reader.h>
#include "summed_area.h"

namespace fieldmark::watermark {

/// Finds candidate cameras of an image by comparing it with small renders of the owner's field. The search
/// knows neither key nor message.
///   - By cells: pairs of places that the extractor recognised propose a similarity transform for each render
///     (RANSAC, Fischler and Bolles 1981). The best few cameras are refined by least squares.
///   - By content: the object's window (see object_window.h), rotated in steps of 15 degrees and reduced to
///     24 pixels, is correlated with the windows of the renders. The image must show the whole object, or the
///     field must fill its images.
///   - By a part: an upright, cropped image is correlated with windows of several sizes in the renders.
class CameraSearch {
 public:
  /// @param owner  of preset fast; must outlive the search
  /// @throws ValueError for another preset or an option out of range
  explicit CameraSearch(const Owner& owner, const CameraSearchOptions& options = {});
  /// Returns at most `count` cameras by cells, best first; none if the extractor recognised fewer than 8
  /// places.
  /// @param places  of an image of height x width pixels
  std::vector<nerf::Camera> find(const SeenPlaces& places, Index height, Index width, Index count) const;
  /// Returns at most `count` cameras by content, best first, each from another render.
  /// @param image  [H, W, 3]
  std::vector<nerf::Camera> find(const Tensor<float>& image, Index count) const;
  /// As find() by content, but on lightness, (max + min) / 2 of a pixel's channels, which hue rotation
  /// preserves.
  std::vector<nerf::Camera> find_by_lightness(const Tensor<float>& image, Index count) const;
  /// Returns the largest correlation by content, in [-1, 1].   @param image  [H, W, 3]
  double likeness(const Tensor<float>& image) const;
  /// Returns at most `count` cameras by a part, best first, each from another render.
  /// @param image  [H, W, 3]
  std::vector<nerf::Camera> find_part(const Tensor<float>& image, Index count) const;

 private:
  struct SeenCell {
    double x, y;       // pixels of the small render
    nerf::Vec3 point;  // world: centroid of the visible samples of the cell
  };
  struct SmallView {
    nerf::Camera camera;
    std::vector<std::int32_t> of_cell;  // [cells] entry in seen, -1 for a hidden cell
    std::vector<SeenCell> seen;
    Window window;             // of the object in the small render
    std::vector<float> small;  // its content, see small_window()
    std::vector<float> light;  // the same for its lightness
    SummedArea area;           // of the whole small render
  };
  struct Match;
  struct Proposal;
  Proposal propose(const SmallView& view, std::size_t number, const std::vector<Match>& matches,
                   double tolerance) const;
  std::vector<Proposal> by_content(const Tensor<float>& image, std::vector<float> SmallView::*content) const;
  Proposal best_part(std::size_t number, std::span<const float> image, double height_to_width) const;
  nerf::Camera proposed(const Proposal& proposal, Index height, Index width) const;
  nerf::Camera fitted(const Proposal& proposal, const std::vector<Match>& matches, double tolerance,
                      Index height, Index width) const;

  const Owner& owner_;
  CameraSearchOptions options_;
  std::vector<SmallView> views_;
};

}  // namespace fieldmark::watermark
