#pragma once
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/mark/view_cache.h>

#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// A mark without networks that teaches the networks of a pooled mark: the coarse cells of a grid carry one
/// bit each, as a texture in one of two colours.
///   c_m = clamp(c + a w(x) u_m, 0, 1),   w(x) = (sin k x_1 + sin k x_2 + sin k x_3) / sqrt(3/2),   k = 32 pi
/// u_1 is a direction from yellow to blue, u_0 one from green to red, |u| = 1. The place identifies the bit;
/// the texture shows its value whatever the colour below. Networks that have to invent a code jointly from
/// pooled bits alone do not start to learn; with a given code, both do.
class FixedCarriers {
 public:
  /// Makes a grid with a fixed number of cells per bit, as coarse as that allows. Equal seeds deal equal
  /// bits.
  /// @param bits  at least 1   @throws ValueError if the views show nothing
  FixedCarriers(std::span<const CachedView> views, Index bits, std::uint64_t seed);

  /// Bit and texture at a position.
  struct Carried {
    std::int32_t bit;  ///< -1: none
    float wave;        ///< w(x); 0: none
  };
  /// Returns what a position carries.   @param x  [3] unit cube
  Carried carried(const float* x) const;
  /// Computes marked colours c_m.   @param message  [bits], -1 or 1   @param x  [n, 3]   @param c  [n, 3]
  /// @param marked  [n, 3], written
  void mark(std::span<const float> message, const float* x, const float* c, Index n, float* marked) const;
  /// Computes the marked image of a view.   @param marked  [height, width, 3], written
  void mark(std::span<const float> message, const CachedView& view, float* marked) const;
  /// Number of cells that carry a bit.
  Index cells() const { return cells_.count(); }

 private:
  CellGrid cells_;
  std::vector<std::int32_t> bit_;
};

}  // namespace fieldmark::watermark
