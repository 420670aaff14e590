#pragma once
#include <fieldmark/watermark/attacks/measurement.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace fieldmark::watermark {

class Readers;

/// What an AttackMeter looks at.
struct AttackMeterOptions {
  std::vector<nerf::Camera> cameras = {};  ///< of the views
  Index group = 10;                        ///< views whose evidence makes one p-value, at least 1
  Index informed_views = 0;  ///< of the first so many views informed is read too; none for preset paper
  std::uint64_t seed = 0;    ///< of the attacks on images
  /// Called after each view of each measurement; returns false to stop, which throws Error.
  std::function<bool(Index done, Index total)> progress = {};
};

/// How a mark fares under one attack, and what the attack costs.
struct AttackRow {
  std::string name;          ///< of the attack
  ReadingAccuracy accuracy;  ///< of one view, mean over views, see Measurement
  double accuracy_p5 = 0;    ///< 5th percentile over views of the blind accuracy
  /// Keyed p-value of a group's views together, read blindly, median over the groups; of all views where they
  /// are fewer.
  double p_value = 1;
  /// Of accuracy.chosen, or of accuracy.blind where informed was not read.
  double chosen() const { return std::isnan(accuracy.chosen) ? accuracy.blind : accuracy.chosen; }
  /// Damage: the attacked against the marked image over the object, dB, mean over views where it is finite;
  /// NaN where there is none, as with a crop.
  double psnr_foreground = 0;
  double kept = 1;  ///< share of the object's pixels that the attacked images still show
};

/// Measures one marked field under many attacks: bit accuracy, evidence and damage from the same views. The
/// damage is the attack's own, against the marked image before it, over pixels whose opacity there exceeds
/// 0.5. An attack that moves pixels is undone first, as its PixelMap says, with bilinear interpolation: then
/// only what it did to the colours counts, and what it cut off is `kept`. Keeps buffers: one object per
/// thread.
class AttackMeter {
 public:
  /// Renders the views. @param owner, marked  must outlive it   @throws ValueError if there are no cameras,
  /// group is below 1, or the message has another length than the owner's
  AttackMeter(const Owner& owner, const nerf::RadianceField& marked, const Message& message,
              const AttackMeterOptions& options);
  ~AttackMeter();
  /// Views of AttackRow::accuracy.informed and .chosen.
  Index informed_views() const;
  /// The marked images as they are.
  AttackRow none() const;
  /// The marked images under an attack. @throws ValueError for a name that parse_distortion() does not know
  AttackRow image(const std::string& name) const;
  /// Images of an attacked field. @param reference  what its damage is measured against, where that is not
  /// the marked field: the field that a mark was copied onto
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

/// PSNR over the object between an image and what an attack left of it, and how much of the object that
/// still shows.
struct AttackDamage {
  double psnr;  ///< dB; infinity where nothing changed, NaN where the object is not in view
  double kept;  ///< share of the object's pixels, 0 to 1; NaN likewise
};
/// @param before  [H, W, 3]   @param opacity  [H, W], the object is where it exceeds 0.5   @param after  [H',
/// W', 3]   @param source  where the pixels of `after` come from   @throws ShapeError if shapes do not fit
AttackDamage attack_damage(const Tensor<float>& before, const Tensor<float>& opacity,
                           const Tensor<float>& after, const distort::PixelMap& source);

}  // namespace fieldmark::watermark
