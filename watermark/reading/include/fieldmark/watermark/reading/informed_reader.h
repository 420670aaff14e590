#pragma once
#include <fieldmark/watermark/reading/blind_reader.h>

#include <limits>
#include <memory>

namespace fieldmark::watermark {

/// Options for finding the camera of an image.
struct CameraSearchOptions {
  Index views = 256;       ///< novel cameras to compare with, at least 1
  Index around = 192;      ///< further cameras from all directions, for an object without surroundings, >= 0
  Index size = 40;         ///< longer side of their renders, pixels, at least 16
  std::uint64_t seed = 0;  ///< of the cameras and of the search
};

/// The informed detector's result for one image.
struct InformedReading {
  /// [cells] S_c, see evidence.h, on the scale of the blind reading, so that both may be added. Empty if no
  /// camera was found, or its agreement is below the least asked for.
  std::vector<double> evidence;
  nerf::Camera camera;    ///< camera found
  double agreement = -1;  ///< of the alignment: correlation of gradients, in [-1, 1]
};

/// Which detector a reading comes from.
enum class ReadingKind { blind, informed };
/// Returns "blind" or "informed".
const char* reading_name(ReadingKind kind);

/// The readings of both detectors, and the choice between them.
struct ImageReading {
  std::vector<double> blind;                ///< [cells] of BlindReader
  InformedReading informed;                 ///< without evidence if no camera was found that agrees enough
  ReadingKind chosen = ReadingKind::blind;  ///< depends on the alignment's agreement alone
  bool mirrored = false;                    ///< only the mirrored image agrees; then all is read from it
  /// Evidence of the chosen detector, [cells].
  const std::vector<double>& evidence() const {
    return chosen == ReadingKind::informed ? informed.evidence : blind;
  }
};

struct Alignment;
struct Surround;
class CameraSearch;

/// Informed detection: finds the camera of an image, subtracts the owner's unmarked render and compares the
/// residual with the carriers of all cells. Like blind detection, it knows neither key nor message, so its
/// evidence may be tested against any.
///
///   - Bars are cut off; for an object, any other plain background is replaced by the field's.
///   - Candidate cameras are aligned coarsely, the best of them finely; the best agreement wins. The first
///     candidates come from 64 renders. A fine alignment that agrees by less than 0.5 at 96 pixels ends
///     there. Below an agreement of 0.95, the search goes on with all renders, then with the mirrored image
///     and with one stretched to where it looks most like the field. An object is tried mirrored below 0.975,
///     for it may be nearly symmetric. Before evidence is taken, the camera of a thin object is aligned once
///     more, at 400 pixels; the agreement stays that at 200.
///   - The image is reduced to 512 pixels on the longer side. Unless it shows JPEG quantisation, it is then
///     reduced to about 48,000 pixels that show the field.
///   - The blur that leaves the smallest residual is kept, and a change of colour is fitted. Of a JPEG image,
///     the likeliest of the renders with and without either is kept, over the field's background and over
///     the image's.
///   - With the residual R and its power V around each pixel, R / V is the score and 1 / V the precision.
///     For a JPEG image both come from the quantised coefficients. If the mark explains less than a tenth of
///     R, colours are turned to axes along which R is uncorrelated: noise is mostly of lightness.
///   - S_c are the signs that explain the whole residual by linear least squares, since a ray passes several
///     cells. Where JPEG, blur or downscaling took detail from the image, the blind evidence is added at
///     equal power: the extractor reads more there. Its weight is the correlation of the two after JPEG, and
///     twice that, at most 1, otherwise; 0 if it is negative.
class InformedReader {
 public:
  /// Least agreement at which an alignment is trusted; docs/notes/reading.md has the measurements.
  static constexpr double kLeastAgreement = 0.85;
  /// @param owner  of preset fast; must outlive the reader
  /// @throws ValueError for another preset or an option out of range
  explicit InformedReader(const Owner& owner, const CameraSearchOptions& search = {});
  ~InformedReader();
  /// Reads an image with both detectors; chooses informed if its agreement is at least kLeastAgreement.
  /// @param image  as BlindReader::evidence()   @param least  agreement below which informed evidence, which
  /// takes long, is left empty   @throws ShapeError, ValueError as BlindReader::evidence()
  ImageReading read(const Tensor<float>& image, double least = -1);
  /// Reads a part of an image that shows an object before anything, from a guess of its camera: pixels
  /// outside the object's outline do not count, neither for the alignment nor for the evidence. Chooses
  /// informed, or leaves the evidence of both detectors empty if the agreement is below `least` or 0.8.
  /// Before evidence is taken, the camera is aligned once more; the agreement stays that before.
  /// @param image  [H, W, 3], sides of at least 16   @param start  of its size; the object must be within a
  /// few hundredths of its size of where it shows it   @param covered  [H W] 1 where something else covers
  /// the view, or empty   @throws ShapeError if the sizes differ or are below 16
  /// @throws ValueError if a value is not finite
  ImageReading read_near(const Tensor<float>& image, const nerf::Camera& start, double least,
                         const std::vector<std::uint8_t>& covered = {});
  /// Computes the evidence of an image with a known camera, of all pixels up to 512 on the longer side.
  /// @param image  [H, W, 3]   @param camera  of its size   @throws ShapeError if the sizes differ
  /// @throws ValueError if a value is not finite
  std::vector<double> evidence_at(const Tensor<float>& image, const nerf::Camera& camera);

 private:
  struct Parts;
  struct Change;
  const CameraSearch& all_views();
  std::vector<Change> changes(const Tensor<float>& seen, bool stretches);
  static constexpr double kNeverEnough = std::numeric_limits<double>::infinity();
  static std::vector<nerf::Camera> lookalikes(const CameraSearch& search, const Tensor<float>& image,
                                              const Change& change);
  bool try_all(const Surround& seen, const Change& change, const std::vector<nerf::Camera>& cameras,
               std::vector<Alignment>& found, double enough = kNeverEnough);
  void try_search(const CameraSearch& search, const Surround& seen, const Change& change,
                  const SeenPlaces& places, std::vector<Alignment>& found, double enough = kNeverEnough);
  Alignment refined(const Surround& seen, const Change& change, const std::vector<Alignment>& found);
  Alignment aligned(const Surround& seen, const Change& change, const SeenPlaces& places);
  ImageReading read_as(const Tensor<float>& whole, const Change& change, double least);
  void add_evidence(const Surround& seen, double shown, ImageReading& reading);
  std::vector<std::uint8_t> outside(const nerf::Camera& camera);
  Surround cleared(const Tensor<float>& whole) const;
  const Owner& owner_;
  BlindReader blind_;
  std::unique_ptr<Parts> parts_;
};

}  // namespace fieldmark::watermark
