#pragma once
#include <fieldmark/watermark/attacks/measurement.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace fieldmark::watermark {

class Readers;

/// Options of AttackMeter.
struct AttackMeterOptions {
  std::vector<nerf::Camera> cameras = {};  ///< of the views
  Index group = 10;                        ///< views per p-value, at least 1
  Index informed_views = 0;                ///< first views that are also read informed; 0 for preset paper
  std::uint64_t seed = 0;                  ///< of the attacks on images
  /// Called after each view of each measurement; returns false to stop, which throws Error.
  std::function<bool(Index done, Index total)> progress = {};
};

/// Robustness of a mark under one attack, and the attack's damage.
struct AttackRow {
  std::string name;          ///< of the attack
  ReadingAccuracy accuracy;  ///< of one view, mean over views, see Measurement
  double accuracy_p5 = 0;    ///< 5th percentile over views of the blind accuracy
  /// Keyed p-value of the chosen readings of a group of views, median over groups; of all views if there are
  /// fewer.
  double p_value = 1;
  /// accuracy.chosen, or accuracy.blind without an informed reading.
  double chosen() const { return std::isnan(accuracy.chosen) ? accuracy.blind : accuracy.chosen; }
  /// Damage: PSNR of the attacked against the marked image on the foreground, dB, mean over the views where
  /// it is finite; NaN if there are none.
  double psnr_foreground = 0;
  double kept = 1;  ///< share of the foreground that the attacked images still show
};

/// Measures a marked field under attacks: bit accuracy, evidence and damage on the same views. Damage
/// compares the attacked with the marked image on the foreground, after undoing the attack's geometry
/// (PixelMap, bilinear), and so counts changes of colour alone. Keeps buffers: use one object per thread.
class AttackMeter {
 public:
  /// Renders the views. @param owner, marked  must outlive the meter   @throws ValueError if there are no
  /// cameras, group is below 1, or the length of the message is not the owner's
  AttackMeter(const Owner& owner, const nerf::RadianceField& marked, const Message& message,
              const AttackMeterOptions& options);
  ~AttackMeter();
  /// Number of views behind AttackRow::accuracy.informed and .chosen.
  Index informed_views() const;
  /// Measures the marked images without an attack.
  AttackRow none() const;
  /// Measures the marked images under an attack.
  /// @throws ValueError for a name that parse_distortion() does not know
  AttackRow image(const std::string& name) const;
  /// Measures renders of an attacked field. @param reference  the field to compare with; null: the marked
  /// field. Needed where a mark was copied onto another field
  AttackRow field(const std::string& name, const nerf::RadianceField& attacked,
                  const nerf::RadianceField* reference = nullptr) const;

 private:
  struct View {
    Tensor<float> rgb;      // 8 bits
    Tensor<float> opacity;  // of the marked field
  };
  class Row;
  void tell(std::size_t done) const;

  const Owner& owner_;
  Message message_;
  AttackMeterOptions options_;
  CellCode code_;
  std::unique_ptr<Readers> readers_;
  std::vector<View> views_;
};

/// Damage of an attack on the foreground of an image.
struct AttackDamage {
  double psnr;  ///< dB; infinity without change, NaN if the foreground is out of view
  double kept;  ///< share of the foreground still in view, 0 to 1; NaN without foreground
};
/// Measures the damage.
/// @param before  [H, W, 3]   @param opacity  [H, W], above 0.5 on the foreground   @param after  [H', W', 3]
/// @param source  origin of the pixels of `after`   @throws ShapeError if shapes do not fit
AttackDamage attack_damage(const Tensor<float>& before, const Tensor<float>& opacity,
                           const Tensor<float>& after, const distort::PixelMap& source);

}  // namespace fieldmark::watermark
