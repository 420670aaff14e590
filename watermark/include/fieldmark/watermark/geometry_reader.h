#pragma once
#include <fieldmark/watermark/camera_search.h>
#include <fieldmark/watermark/pose_alignment.h>

namespace fieldmark::watermark {

/// What a picture shows when it is laid over the owner's field.
struct GeometryReading {
  /// [cells] S_c, see evidence.h, on the scale of the blind reading's: views read either way may be added.
  /// Empty where no camera was found.
  std::vector<double> evidence;
  nerf::Camera camera;    ///< found
  double agreement = -1;  ///< of the alignment, see Alignment
};

/// Which reading of a picture to believe.
enum class ReadingKind { blind, geometry };
/// "blind" or "geometry".
const char* reading_name(ReadingKind kind);

/// Both readings of a picture, and which is to be believed.
struct PictureReading {
  std::vector<double> blind;                ///< [cells] of PictureReader
  GeometryReading geometry;                 ///< without evidence where it was not tried
  ReadingKind chosen = ReadingKind::blind;  ///< by the alignment's agreement alone
  /// [cells] of the chosen one.
  const std::vector<double>& evidence() const {
    return chosen == ReadingKind::geometry ? geometry.evidence : blind;
  }
};

/// The informed reading: finds the camera of a picture, subtracts the owner's unmarked view and compares what
/// is left with what the mark would add in each cell. It needs the owner's field, which a blind reader does
/// not; like it, it knows neither key nor message, so that its evidence may be tested against any.
///
///   - Cameras are proposed by CameraSearch and aligned coarse to fine by PoseAligner; the one that agrees
///     best is kept.
///   - The picture's blur is taken for the one of a few that leaves least; gain, offset and gamma are fitted.
///   - Of the difference left R, whose power around each pixel is V, R / V is the score of a MarkScore and
///     1 / V its precision; of a picture that find_jpeg() recognises both are jpeg_score()'s.
///   - The cells' signs are those that explain all of it together, S_c = s_c of fit_signs(): a pixel's ray
///     passes several cells, in a scene without hard surfaces many.
class GeometryReader {
 public:
  /// Least agreement at which an alignment is believed. In the tests the best camera of another scene of the
  /// same make stays below 0.8, and that of the scene itself exceeds 0.95.
  static constexpr double kLeastAgreement = 0.85;
  /// @param owner  of preset fast; must outlive this   @throws ValueError if it is of another preset
  explicit GeometryReader(const Owner& owner, const CameraSearchOptions& search = {});
  /// Both readings; geometry is chosen where its alignment agrees to kLeastAgreement.
  /// @throws ShapeError as PictureReader
  PictureReading read(const Tensor<float>& picture);
  /// Evidence of a picture whose camera is known.   @param picture  [H, W, 3]   @param camera  of its size
  std::vector<double> evidence_at(const Tensor<float>& picture, const nerf::Camera& camera);

 private:
  const Owner& owner_;
  PictureReader blind_;
  CameraSearch search_;
  PoseAligner aligner_;
  nerf::Renderer renderer_;
};

}  // namespace fieldmark::watermark
