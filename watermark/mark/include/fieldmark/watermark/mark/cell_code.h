#pragma once
#include <fieldmark/engine/shape.h>
#include <fieldmark/watermark/keys/key.h>
#include <fieldmark/watermark/mark/cell_grid.h>
#include <fieldmark/watermark/payload/message.h>

#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Which bit of the message each cell of a scene carries, and with which sign.
struct CellCode {
  /// [cells] index of the bit, -1 for a cell that carries none.
  std::vector<std::int32_t> bit;
  /// [cells] +1 or -1, 0 for a cell that carries no bit.
  std::vector<std::int8_t> sign;
  /// Number of cells that carry a bit.
  Index carriers() const;
};

/// Deals the cells of one scene to the bits of a message, for any number of keys.
/// If strengths were measured, the cells are divided into n_bits classes so that each of the views shows
/// about as much of one class as of another; a keyed permutation gives every bit a class. Otherwise cells are
/// ranked by visible area, largest first (ties: lower index first), and cut into groups of n_bits; in each
/// group a keyed permutation gives every bit one cell, so total areas differ little between bits. Either way
/// no bit is without cells. The signs are a second stream of the key, so they are fair and independent
/// whatever the image and the division. Dealing compares weights exactly: store the weights (or the code)
/// instead of recomputing them on another machine.
class CellDealer {
 public:
  /// @param n_bits  1 to the number of cells of positive area
  /// @throws ValueError otherwise, or if an area or a strength is out of range
  /// @throws ShapeError if the strengths are not those of whole views
  CellDealer(const CellWeights& weights, Index n_bits);
  /// Overwrites code and reuses its storage.
  void deal(const Key& key, CellCode& code) const;

 private:
  std::size_t cells_, n_bits_;
  std::size_t group_;                  // ranked cells after which classes get other bits
  std::vector<std::size_t> ranked_;    // cells of positive area, by area or strength, largest first
  std::vector<std::int32_t> classes_;  // of the ranked cells
};

/// CellDealer for a single key.   @throws ValueError as CellDealer does
CellCode deal_cells(const Key& key, const CellWeights& weights, Index n_bits);

/// Returns the sign that each cell shows for a message.
///   s_c = (2 M[bit_c] - 1) sign_c, 0 for a cell that carries no bit
/// @return [cells]   @throws ValueError if a cell's bit lies outside the message
std::vector<std::int8_t> cell_signs(const CellCode& code, const Message& message);

}  // namespace fieldmark::watermark
