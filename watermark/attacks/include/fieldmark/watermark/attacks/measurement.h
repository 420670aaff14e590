#pragma once
#include <fieldmark/distort/distortion.h>
#include <fieldmark/imaging/lpips.h>
#include <fieldmark/watermark/reading/informed_reader.h>

#include <functional>
#include <limits>
#include <map>
#include <string>

namespace fieldmark::watermark {

/// p-value at which ReadingAccuracy::found counts a mark as found, the default of `fieldmark verify`.
inline constexpr double kFoundAt = 1e-6;

/// Bit accuracies of the detectors, and how often one view proves the mark; NaN for a detector that was not
/// used.
struct ReadingAccuracy {
  double blind = 0;  ///< blind detection
  /// Informed detection on the first informed_views views, or on their parts if those alone agree with the
  /// field; a view whose camera is not found counts as 0.5.
  double informed = std::numeric_limits<double>::quiet_NaN();
  /// Detection as chosen by PageReader, on the same views.
  double chosen = std::numeric_limits<double>::quiet_NaN();
  /// Share of these views, of all views without informed detection, whose keyed p-value by the detection
  /// chosen is at most kFoundAt.
  double found = std::numeric_limits<double>::quiet_NaN();
};

/// Options of measure().
struct MeasureOptions {
  std::vector<nerf::Camera> cameras = {};  ///< of the views, at full resolution
  std::vector<std::string> under = {};     ///< names of parse_distortion(), besides none
  Index informed_views = 0;                ///< first views that are also read informed; 0 for preset paper
  std::uint64_t seed = 0;                  ///< of messages and distortions
  std::function<Message(Index view)> messages = {};  ///< messages to embed unless one is baked; empty: random
  /// Called with the chosen evidence of each image; `under` is the distortion, empty for none.
  std::function<void(Index view, const std::string& under, const std::vector<double>& evidence,
                     const Message& sent)>
      on_reading = {};
  const Lpips<float>* lpips = nullptr;  ///< network of Measurement::lpips_base; null: lpips_base is NaN
  std::function<bool(Index done, Index total)> progress = {};  ///< returns false to stop, which throws Error
};

/// Quality of marked images and bit accuracy of single views.
struct Measurement {
  Index bits = 0;      ///< length of the message
  Index views = 0;     ///< measured
  bool baked = false;  ///< true if a baked field was measured
  /// Share of correct bits in a view, mean over views; an undecided bit counts as 0.5.
  ReadingAccuracy accuracy;
  double accuracy_p5 = 0;           ///< 5th percentile over views of the blind accuracy
  double psnr_base = 0;             ///< marked against unmarked, dB, both rounded to 8 bits, mean over views
  double psnr_base_foreground = 0;  ///< the same over pixels whose unmarked opacity exceeds 0.5
  double ssim_base = 0;             ///< marked against unmarked, mean over views
  double lpips_base = 0;  ///< the same, both rounded to 8 bits; NaN without a network or for tiny views
  std::map<std::string, ReadingAccuracy> under;  ///< for each distortion
  Index informed_views = 0;                      ///< views of accuracy.informed
  double informed_seconds =
      0;  ///< of PageReader for one image, with informed evidence of all, mean; NaN without informed views
  double blind_seconds = 0;  ///< of BlindReader for one image, mean
};

/// Measures an owner's mark: each view carries its own random message, or all carry that of the baked field.
/// @param baked, message  both or neither   @throws ValueError if only one is given or a distortion is
/// unknown
Measurement measure(const Owner& owner, const nerf::RadianceField* baked, const Message* message,
                    const MeasureOptions& options);

}  // namespace fieldmark::watermark
