#pragma once
#include <fieldmark/watermark/reading/camera_search.h>
#include <fieldmark/watermark/reading/pose_alignment.h>

namespace fieldmark::watermark {

/// What an image shows when it is laid over the owner's field.
struct InformedReading {
  /// [cells] S_c, see evidence.h, on the scale of the blind detection's: views read either way may be added.
  /// Empty where no camera was found.
  std::vector<double> evidence;
  nerf::Camera camera;    ///< found
  double agreement = -1;  ///< of the alignment, see Alignment
};

/// Which reading of an image to believe.
enum class ReadingKind { blind, informed };
/// "blind" or "informed".
const char* reading_name(ReadingKind kind);

/// Both readings of an image, and which is to be believed.
struct ImageReading {
  std::vector<double> blind;                ///< [cells] of BlindReader
  InformedReading informed;                 ///< without evidence where it was not tried
  ReadingKind chosen = ReadingKind::blind;  ///< by the alignment's agreement alone
  /// [cells] of the chosen one.
  const std::vector<double>& evidence() const {
    return chosen == ReadingKind::informed ? informed.evidence : blind;
  }
};

/// The informed detection: finds the camera of an image, subtracts the owner's unmarked view and compares
/// what is left with what the mark would add in each cell. It needs the owner's field, which a blind reader
/// does not; like it, it knows neither key nor message, so that its evidence may be tested against any.
///
///   - Cameras are proposed by CameraSearch and aligned coarse to fine by PoseAligner; the one that agrees
///     best is kept.
///   - The image's blur is taken for the one of a few that leaves least; gain, offset and gamma are fitted.
///   - Of the difference left R, whose power around each pixel is V, R / V is the score of a MarkScore and
///     1 / V its precision; of an image that find_jpeg() recognises both are jpeg_score()'s.
///   - The cells' signs are those that explain all of it together, S_c = s_c of fit_signs(): a pixel's ray
///     passes several cells, in a scene without hard surfaces many.
class InformedReader {
 public:
  /// Least agreement at which an alignment is believed. In the tests the best camera of another scene of the
  /// same make stays below 0.8, and that of the scene itself exceeds 0.95.
  static constexpr double kLeastAgreement = 0.85;
  /// @param owner  of preset fast; must outlive this   @throws ValueError if it is of another preset
  explicit InformedReader(const Owner& owner, const CameraSearchOptions& search = {});
  /// Both readings; informed is chosen where its alignment agrees to kLeastAgreement.
  /// @throws ShapeError as BlindReader
  ImageReading read(const Tensor<float>& image);
  /// Evidence of an image whose camera is known.   @param image  [H, W, 3]   @param camera  of its size
  std::vector<double> evidence_at(const Tensor<float>& image, const nerf::Camera& camera);

 private:
  const Owner& owner_;
  BlindReader blind_;
  CameraSearch search_;
  PoseAligner aligner_;
  nerf::Renderer renderer_;
};

}  // namespace fieldmark::watermark
