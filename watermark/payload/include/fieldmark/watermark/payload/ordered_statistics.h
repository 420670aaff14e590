#pragma once
#include <fieldmark/engine/shape.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Decoding of any short binary linear code from logits: the bits' strengths count, not only their signs.
/// The most reliable independent positions are taken as they are seen, and every choice of up to `order` of
/// them flipped; of the codewords that this gives, the one that agrees best is the answer. Source: Fossorier
/// and Lin 1995 (soft-decision decoding of linear block codes based on ordered statistics).
class OrderedStatistics {
 public:
  /// @param generator  [k][n] linearly independent words that span the code, each bit 0 or 1; n at most 256
  /// @throws ValueError for no words, words of several lengths or too long, or words that are dependent
  explicit OrderedStatistics(const std::vector<std::vector<std::uint8_t>>& generator);

  /// The codeword c found to have most of sum_i logit_i (2 c_i - 1); the same for the same input. Equal
  /// strengths count by position, so that a logit of 0 is an erasure.
  /// @param logits  [n] finite; positive where the bit seems to be 1   @param order  0 to 3: time grows as
  /// k^order
  /// @throws ValueError for another size, a number that is not finite, or another order
  std::vector<std::uint8_t> nearest(std::span<const double> logits, int order) const;

 private:
  using Word = std::array<std::uint64_t, 4>;
  std::vector<Word> reduced(std::span<const double> logits, std::vector<std::size_t>& pivots) const;
  std::size_t length_;
  std::vector<Word> generator_;
};

}  // namespace fieldmark::watermark
