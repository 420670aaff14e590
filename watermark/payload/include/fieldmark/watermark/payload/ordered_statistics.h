#pragma once
#include <fieldmark/engine/shape.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// Soft-decision decoder of any short binary linear code. It re-encodes the hard decisions on the most
/// reliable independent positions with up to `order` of them flipped, and returns the codeword that agrees
/// best. Source: Fossorier and Lin 1995 (ordered statistics decoding).
class OrderedStatistics {
 public:
  /// @param generator  [k][n] linearly independent words that span the code, each bit 0 or 1; n at most 256
  /// @throws ValueError if there are no words, or they differ in length, are too long or dependent
  explicit OrderedStatistics(const std::vector<std::vector<std::uint8_t>>& generator);

  /// Returns the codeword c with the largest sum_i logit_i (2 c_i - 1) among those tried. Ties are broken by
  /// position; a logit of 0 is an erasure.
  /// @param logits  [n] finite; positive for a 1   @param order  0 to 3: time grows as k^order
  /// @throws ValueError otherwise
  std::vector<std::uint8_t> nearest(std::span<const double> logits, int order) const;

 private:
  using Word = std::array<std::uint64_t, 4>;
  std::vector<Word> reduced(std::span<const double> logits, std::vector<std::size_t>& pivots) const;
  std::size_t length_;
  std::vector<Word> generator_;
};

}  // namespace fieldmark::watermark
