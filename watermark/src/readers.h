#pragma once
#include <fieldmark/watermark/measurement.h>

#include <chrono>
#include <optional>
#include <vector>

#include "means.h"

namespace fieldmark::watermark {

// Both readings of pictures, and what they cost.
class Readers {
 public:
  // For preset paper there is no reading by geometry. Owner and code must outlive it.
  Readers(const Owner& owner, const CellCode& code, bool by_geometry)
      : owner_(owner), code_(code), blind_(owner) {
    if (by_geometry && owner.reader) geometry_.emplace(owner);
  }
  bool by_geometry() const { return geometry_.has_value(); }
  // Only geometry's numbers may be NaN. Calls tell() with the chosen reading's evidence.
  template <class F>
  ReadingAccuracy read(const Tensor<float>& picture, const Message& sent, bool with_geometry, F tell) {
    ReadingAccuracy accuracy;
    if (!with_geometry || !geometry_) {
      const auto evidence = blind_.evidence(picture);
      tell(evidence);
      accuracy.blind = share(evidence, sent);
      return accuracy;
    }
    const auto begin = std::chrono::steady_clock::now();
    const PictureReading reading = geometry_->read(picture);
    seconds_.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    tell(reading.evidence());
    accuracy.blind = share(reading.blind, sent);
    accuracy.geometry = share(reading.geometry.evidence, sent);
    accuracy.chosen = share(reading.evidence(), sent);
    return accuracy;
  }
  // Of one picture by geometry and blindly, mean; NaN without one.
  double seconds() const { return finite_mean(seconds_); }

 private:
  double share(const std::vector<double>& evidence, const Message& sent) const {
    if (evidence.empty()) return 0.5;
    return match_bits(read_bits(evidence, code_, owner_.options().bits), sent).accuracy();
  }
  const Owner& owner_;
  const CellCode& code_;
  PictureReader blind_;
  std::optional<GeometryReader> geometry_;
  std::vector<double> seconds_;
};

// Accuracies of the views so far.
struct Accuracies {
  std::vector<double> blind, geometry, chosen;
  void add(const ReadingAccuracy& a) {
    blind.push_back(a.blind);
    geometry.push_back(a.geometry);
    chosen.push_back(a.chosen);
  }
  ReadingAccuracy mean() const { return {finite_mean(blind), finite_mean(geometry), finite_mean(chosen)}; }
};

}  // namespace fieldmark::watermark
