#pragma once
#include <fieldmark/engine/shape.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// What each cell of a scene is worth when the cells are dealt to bits.
struct CellWeights {
  std::span<const double> area;  ///< [cells] visible area, any unit, finite and >= 0; 0: gets no bit
  /// [views, cells] evidence that each of some views shows of a cell, any unit, >= 0; empty if it was not
  /// measured. Whole numbers: dealing compares sums of them exactly, on any machine.
  std::span<const std::int32_t> strength = {};

  /// Weights by area alone.
  CellWeights(std::span<const double> area_) : area(area_) {}
  /// Weights by area alone.
  CellWeights(const std::vector<double>& area_) : area(area_) {}
  /// Weights by strength.
  CellWeights(std::span<const double> area_, std::span<const std::int32_t> strength_)
      : area(area_), strength(strength_) {}
};

/// The cells of a scene that can carry a bit: those places of a regular grid over the field's cube that views
/// show. Cells are geometry and not secret; the key decides which bit a cell carries, and with which sign
/// (see CellCode).
class CellGrid {
 public:
  /// @param side  cells per axis, 2 to 64   @param area  [side^3] visible area of every place, x fastest, >=
  /// 0; places above `least` of the total become cells, numbered in the order of the grid
  /// @throws ValueError if side is out of range or no cell is visible   @throws ShapeError if the area has
  /// another size
  CellGrid(Index side, std::span<const double> area, double least = 1e-5);

  /// Places of the grid per axis.
  Index side() const { return side_; }
  /// Number of cells.
  Index count() const { return static_cast<Index>(area_.size()); }
  /// [count] visible area of each cell, as a fraction of the total.
  std::span<const double> area() const { return area_; }
  /// [views, count] evidence that each of some views shows of a cell; empty if it was not measured.
  std::span<const std::int32_t> strength() const { return strength_; }
  /// Sets the strengths, by which the cells are dealt from now on; none to deal by area.
  /// @throws ShapeError if they are not [views, count]   @throws ValueError if one is negative
  void set_strength(std::vector<std::int32_t> strength);
  /// Returns what the cells are worth when they are dealt. The grid must outlive it.
  CellWeights weights() const { return {area_, strength_}; }
  /// [side^3] number of the cell at each place of the grid, -1 where there is none.
  std::span<const std::int32_t> numbers() const { return numbers_; }
  /// Makes a grid from stored numbers and areas. @throws ValueError if they do not fit each other
  static CellGrid from_numbers(Index side, std::span<const std::int32_t> numbers,
                               std::span<const double> area);

  /// Returns the place in the grid of a position in the unit cube; positions outside are clamped.
  static Index place(Index side, const float x[3]);
  /// Returns the cell that contains a position, -1 if none.
  std::int32_t at(const float x[3]) const { return numbers_[static_cast<std::size_t>(place(side_, x))]; }

  /// Blends the signs of cells into a continuous field: trilinear between the centres of neighbouring cells,
  /// steepened by 3 and clamped to [-1, 1], so it is +-1 inside a cell and crosses 0 at a face only where the
  /// sign changes there. @param signs [count]  @param x [n, 3]  @param s [n] written; 0 where no cell is near
  void blend(std::span<const std::int8_t> signs, const float* x, Index n, float* s) const;

  /// The cells that blend() mixes at one position, and each cell's part of the mark there.
  struct Mix {
    Index count = 0;                     ///< at most 8
    std::array<std::int32_t, 8> cell{};  ///< [count] each once
    std::array<float, 8> part{};         ///< [count] in [0, 1]
  };
  /// Returns the weights of the best linear estimate of what blend() gives. Since signs are independent,
  /// part_c is the mean, over all signs that the cells could have, of c's sign times what blend() gives.
  /// Inside a cell, its part is 1.
  /// @param x  [3]
  Mix mix(const float* x) const;

 private:
  struct Near {
    int count = 0;
    std::int32_t cell[8];
    float weight[8];  // sum 1
  };
  Near near(const float* x) const;
  CellGrid() = default;
  Index side_ = 0;
  std::vector<std::int32_t> numbers_;
  std::vector<double> area_;
  std::vector<std::int32_t> strength_;
};

}  // namespace fieldmark::watermark
