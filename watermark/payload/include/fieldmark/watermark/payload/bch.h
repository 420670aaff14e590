#pragma once
#include <fieldmark/engine/shape.h>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace fieldmark::watermark {

/// A decoder's result.
struct CorrectedWord {
  std::vector<std::uint8_t> bits;  ///< [length] the codeword, each 0 or 1
  Index corrected = 0;             ///< bits in which the codeword differs from the given word
};

/// A binary BCH code: narrow-sense, primitive, shortened to `length` bits, systematic.
///   codewords c with c(alpha^j) = 0 for j = 1 .. 2 t, alpha primitive in GF(2^m); bit i is the coefficient
///   of x^(length - 1 - i), and those beyond length are 0
/// Source: Bose and Ray-Chaudhuri 1960, Hocquenghem 1959; decoding after Berlekamp 1968, Massey 1969 and
/// Chien 1964.
class Bch {
 public:
  /// @param m  3 to 8   @param t  errors to correct, at least 1   @param length  1 to 2^m - 1
  /// @throws ValueError out of range, or if no information bit is left
  Bch(int m, Index t, Index length);

  /// Returns the code that corrects the most errors with `dimension` information bits.
  /// @return nothing if no code corrects one error   @throws ValueError as the constructor
  static std::optional<Bch> strongest(int m, Index length, Index dimension);

  /// Number of bits of a codeword.
  Index length() const { return length_; }
  /// Number of information bits, which come first.
  Index dimension() const { return length_ - check_bits(); }
  /// Number of check bits: the degree of the generator.
  Index check_bits() const { return static_cast<Index>(generator_.size()) - 1; }
  /// Number of errors that are always corrected: half the number of successive powers alpha, alpha^2, ...
  /// that are roots. It can exceed the constructor's t.
  Index corrects() const { return corrects_; }

  /// Encodes information bits.
  /// @param information  [dimension] each 0 or 1   @return [length]   @throws ValueError otherwise
  std::vector<std::uint8_t> encode(std::span<const std::uint8_t> information) const;

  /// Finds the one codeword that differs from the word in at most corrects() bits.
  /// @param word  [length] each 0 or 1   @return nothing if no codeword does   @throws ValueError otherwise
  std::optional<CorrectedWord> decode(std::span<const std::uint8_t> word) const;

 private:
  unsigned multiply(unsigned a, unsigned b) const;
  unsigned power(Index exponent) const { return exp_[static_cast<std::size_t>(exponent % order_)]; }
  std::vector<std::uint8_t> minimal_polynomial(Index exponent) const;
  std::vector<unsigned> syndromes(std::span<const std::uint8_t> word) const;
  std::vector<unsigned> error_locator(const std::vector<unsigned>& s) const;
  void check_word(const char* op, std::span<const std::uint8_t> word, Index size) const;

  Index order_, length_, corrects_ = 0;  // order_ = 2^m - 1
  std::vector<unsigned> exp_, log_;
  std::vector<std::uint8_t> generator_;  // coefficients, highest power first
};

}  // namespace fieldmark::watermark
