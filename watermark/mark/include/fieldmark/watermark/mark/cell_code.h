#pragma once
#include <fieldmark/engine/shape.h>
#include <fieldmark/watermark/keys/key.h>
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
/// Cells are ranked by visible area, largest first (ties: lower index first), and cut into groups of n_bits;
/// in each group a keyed permutation gives every bit one cell, so total areas differ little between bits and
/// no bit is without cells. The signs are a second stream of the key, so they are fair and independent
/// whatever the image. Ranks compare areas exactly: store the areas (or the code) instead of recomputing them
/// on another machine.
class CellDealer {
 public:
  /// @param area    [cells] visible area, any unit, finite and >= 0; a cell of area 0 gets no bit
  /// @param n_bits  1 to the number of cells of positive area
  /// @throws ValueError otherwise
  CellDealer(std::span<const double> area, Index n_bits);
  /// Overwrites code and reuses its storage.
  void deal(const Key& key, CellCode& code) const;

 private:
  std::size_t cells_, n_bits_;
  std::vector<std::size_t> ranked_;  // cells of positive area, largest first
};

/// CellDealer for a single key.   @throws ValueError as CellDealer does
CellCode deal_cells(const Key& key, std::span<const double> area, Index n_bits);

/// Returns the sign that each cell shows for a message.
///   s_c = (2 M[bit_c] - 1) sign_c, 0 for a cell that carries no bit
/// @return [cells]   @throws ValueError if a cell's bit lies outside the message
std::vector<std::int8_t> cell_signs(const CellCode& code, const Message& message);

}  // namespace fieldmark::watermark
