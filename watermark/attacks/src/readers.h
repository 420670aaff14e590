#pragma once
#include <fieldmark/watermark/attacks/measurement.h>
#include <fieldmark/watermark/scanning/page_reader.h>

#include <chrono>
#include <optional>
#include <vector>

#include <fieldmark/imaging/means.h>

namespace fieldmark::watermark {

// Reads images with both detectors, and measures the time.
class Readers {
 public:
  // Without cells there is no informed detection. Owner and code must outlive the readers.
  Readers(const Owner& owner, const CellCode& code, bool informed)
      : owner_(owner), code_(code), blind_(owner) {
    if (informed && owner.mark().has_cells()) informed_.emplace(owner);
  }
  bool informed() const { return informed_.has_value(); }
  // Only the blind accuracy is never NaN. Calls tell() with the chosen reading's evidence.
  template <class F>
  ReadingAccuracy read(const Tensor<float>& image, const Message& sent, bool with_informed, F tell) {
    ReadingAccuracy accuracy;
    if (!with_informed || !informed_) {
      auto evidence = timed(blind_seconds_, [&] { return blind_.evidence(image); });
      if (informed_)
        for (double& s : evidence) s *= PageReading::kBlindWeight;
      tell(evidence);
      accuracy.blind = share(evidence, sent);
      if (!informed_) accuracy.found = found(evidence, sent);
      return accuracy;
    }
    // Informed detection reads blindly too; a few images more tell how long that takes alone.
    if (std::ssize(blind_seconds_) < kTimedBlind)
      timed(blind_seconds_, [&] { return blind_.evidence(image); });
    const PageReading page = timed(seconds_, [&] { return informed_->read(image, true); });
    const std::vector<double> evidence = page.evidence();
    tell(evidence);
    accuracy.blind = share(page.whole.blind, sent);
    accuracy.informed = share(page.parts.empty() ? page.whole.informed.evidence : evidence, sent);
    accuracy.chosen = share(evidence, sent);
    accuracy.found = found(evidence, sent);
    return accuracy;
  }
  // Mean time of reading one image with both detectors; NaN without images.
  double seconds() const { return finite_mean(seconds_); }
  // The same with blind detection.
  double blind_seconds() const { return finite_mean(blind_seconds_); }

 private:
  static constexpr Index kTimedBlind = 20;  // images

  template <class F>
  static auto timed(std::vector<double>& seconds, F read) {
    const auto begin = std::chrono::steady_clock::now();
    auto result = read();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    return result;
  }
  double share(const std::vector<double>& evidence, const Message& sent) const {
    if (evidence.empty()) return 0.5;
    return match_bits(read_bits(evidence, code_, owner_.options().bits), sent).accuracy();
  }
  double found(const std::vector<double>& evidence, const Message& sent) const {
    return keyed_p_value(keyed_statistic(evidence, code_, sent)) <= kFoundAt ? 1 : 0;
  }
  const Owner& owner_;
  const CellCode& code_;
  BlindReader blind_;
  std::optional<PageReader> informed_;
  std::vector<double> seconds_, blind_seconds_;
};

// Accuracies of the views so far.
struct Accuracies {
  std::vector<double> blind, informed, chosen, found;
  void add(const ReadingAccuracy& a) {
    blind.push_back(a.blind);
    informed.push_back(a.informed);
    chosen.push_back(a.chosen);
    found.push_back(a.found);
  }
  ReadingAccuracy mean() const {
    return {finite_mean(blind), finite_mean(informed), finite_mean(chosen), finite_mean(found)};
  }
};

}  // namespace fieldmark::watermark
