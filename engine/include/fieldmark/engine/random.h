#pragma once
#include <fieldmark/engine/shape.h>

#include <array>
#include <cstdint>
#include <vector>

namespace fieldmark {

/// Counter-based random numbers: each is a function of (seed, stream, a, b), so neither the thread count nor
/// resuming a run changes it. Use a for the step or image and b for the ray or sample in it.
///   words(a, b) = Philox4x32-10(counter = a | b << 64, key),   key = seed for stream 0
/// Source: Salmon et al. 2011 (Parallel random numbers: as easy as 1, 2, 3), section 3.3.
/// The key of any other stream is half a Philox block of the stream's number under the seed, so that two
/// streams share a key with probability 2^-64. Cheap to copy.
class CounterRng {
 public:
  /// @param stream  separates the uses of one seed: pixels, backgrounds, messages
  explicit CounterRng(std::uint64_t seed, std::uint64_t stream = 0);

  /// Returns four independent words of 32 random bits.
  std::array<std::uint32_t, 4> bits(std::uint64_t a, std::uint64_t b = 0) const;
  /// Returns a number in [0, 1), a multiple of 2^-24: the first of uniform4().
  float uniform(std::uint64_t a, std::uint64_t b = 0) const;
  /// Returns four independent numbers in [0, 1), multiples of 2^-24.
  std::array<float, 4> uniform4(std::uint64_t a, std::uint64_t b = 0) const;
  /// Returns a number in [0, 1), a multiple of 2^-53.
  double uniform_double(std::uint64_t a, std::uint64_t b = 0) const;
  /// Returns two independent standard normal numbers: the first two of normal4().
  std::array<float, 2> normal2(std::uint64_t a, std::uint64_t b = 0) const;
  /// Returns four independent standard normal numbers, at most 6.67 in magnitude.
  /// Source: Box and Muller 1958.
  std::array<float, 4> normal4(std::uint64_t a, std::uint64_t b = 0) const;
  /// Returns an integer in [0, n), uniform to within n / 2^64.   @throws ValueError unless n is positive
  Index below(Index n, std::uint64_t a, std::uint64_t b = 0) const;

 private:
  std::array<std::uint32_t, 2> key_;
};

/// Returns a uniformly random permutation of 0 .. n - 1 (Fisher and Yates), drawn from rng at (a, 0 .. n -
/// 1).
/// @throws ValueError if n is negative
std::vector<Index> permutation(Index n, const CounterRng& rng, std::uint64_t a);

}  // namespace fieldmark
