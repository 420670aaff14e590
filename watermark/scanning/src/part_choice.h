#pragma once
// Which place of an image shows the object best. Private.
#include <fieldmark/engine/tensor.h>

#include <algorithm>
#include <limits>

namespace fieldmark::watermark {

/// Chooses among the places of an image by their agreement. A whole object replaces every quarter, for a
/// quarter shows fewer cells, and a part of at least kLarge pixels every smaller one, which shows little of
/// the mark.
///
/// The least agreements were chosen on 96 images of something else, for two owners: whole objects stayed
/// below 0.8, quarters reached 0.927 and parts below kLarge 0.962. docs/notes/reading.md has the
/// measurements.
class PartChoice {
 public:
  static constexpr Index kLeast = 48, kLarge = 60;  ///< longer side, pixels
  static constexpr double kLeastWhole = 0.9, kLeastQuarter = 0.94, kLeastSmall = 0.97;
  static constexpr double kSure = 0.95;  ///< at which a large part is final
  /// Returns the agreement that a place needs to be chosen, infinity if none is enough.
  /// @param whole  whether the object is there whole   @param longer  side of the place, pixels
  double needed(bool whole, Index longer) const {
    const bool large = longer >= kLarge;
    if (longer < kLeast || (whole_ && !whole) || (large_ && !large))
      return std::numeric_limits<double>::infinity();
    const double least = !large ? kLeastSmall : whole ? kLeastWhole : kLeastQuarter;
    const bool replaces = (whole && !whole_) || (large && !large_);
    return replaces ? least : std::max(least, most_);
  }
  /// Chooses a place whose agreement is what it needed.
  void take(bool whole, Index longer, double agreement) {
    whole_ = whole;
    large_ = longer >= kLarge;
    most_ = agreement;
  }
  /// True if a large part agrees so well that no other place needs to be tried.
  bool is_final() const { return large_ && most_ >= kSure; }

 private:
  bool whole_ = false, large_ = false;
  double most_ = 0;
};

}  // namespace fieldmark::watermark
