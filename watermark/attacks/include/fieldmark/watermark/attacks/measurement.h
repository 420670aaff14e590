#pragma once
#include <fieldmark/distort/distortion.h>
#include <fieldmark/imaging/lpips.h>
#include <fieldmark/watermark/reading/informed_reader.h>

#include <functional>
#include <limits>
#include <map>
#include <string>

namespace fieldmark::watermark {

/// Accuracies of the two readings; a reading that was not made is NaN.
struct ReadingAccuracy {
  double blind = 0;  ///< of the reading from the image alone
  /// Of the informed detection, over the first informed_views views; a view whose camera was not found
  /// counts 0.5.
  double informed = std::numeric_limits<double>::quiet_NaN();
  /// Of the reading that InformedReader chooses, over the same views.
  double chosen = std::numeric_limits<double>::quiet_NaN();
};

/// What measure() looks at.
struct MeasureOptions {
  std::vector<nerf::Camera> cameras = {};  ///< of the views, at their full resolution
  std::vector<std::string> under = {};     ///< distortions besides none, names of parse_distortion()
  Index informed_views = 0;  ///< of the first so many views informed is read too; 0 for preset paper
  std::uint64_t seed = 0;    ///< of messages and distortions
  std::function<Message(Index view)> messages = {};  ///< in place of random messages, where none is baked
  /// Called with the evidence of each image that was read, of the reading that was chosen (blind where only
  /// that was tried); `under` is empty for the view as it is.
  std::function<void(Index view, const std::string& under, const std::vector<double>& evidence,
                     const Message& sent)>
      on_reading = {};
  const Lpips<float>* lpips = nullptr;  ///< network of Measurement::lpips_base; null: it is NaN
  std::function<bool(Index done, Index total)> progress = {};  ///< returns false to stop, which throws Error
};

/// What a mark does to images and how well it is read from one view at a time.
struct Measurement {
  Index bits = 0;      ///< length of the message
  Index views = 0;     ///< that were read
  bool baked = false;  ///< whether a baked field was measured
  ReadingAccuracy
      accuracy;            ///< share of bits right in one view, mean over views; an undecided bit counts 0.5
  double accuracy_p5 = 0;  ///< 5th percentile over views of the blind accuracy
  double psnr_base = 0;    ///< marked against unmarked, dB, both rounded to 8 bits, mean over views
  double psnr_base_foreground = 0;  ///< the same over pixels whose unmarked opacity exceeds 0.5
  double ssim_base = 0;             ///< marked against unmarked, mean over views
  double lpips_base = 0;  ///< the same, both rounded to 8 bits; NaN without a network or where views are too
                          ///< small for it
  std::map<std::string, ReadingAccuracy> under;  ///< for each distortion
  Index informed_views = 0;                      ///< views of accuracy.informed
  double informed_seconds = 0;  ///< of one image's informed detection and blindly, mean; NaN without one
};

/// Measures an owner's mark: each view with its own random message or, given a baked field, with the message
/// baked in.
/// @param baked, message  both or neither   @throws ValueError if only one is given, or an attack's name is
/// wrong
Measurement measure(const Owner& owner, const nerf::RadianceField* baked, const Message* message,
                    const MeasureOptions& options);

}  // namespace fieldmark::watermark
