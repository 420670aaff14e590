#pragma once
#include <fieldmark/watermark/geometry_reader.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "cli/context.h"

namespace fieldmark::cli {

/// What one picture shows.
struct PictureEvidence {
  std::string image;
  std::vector<double> cells;                                       ///< sign evidence S_c
  watermark::ReadingKind reading = watermark::ReadingKind::blind;  ///< where it comes from
  double agreement =
      std::nan("");      ///< of the picture with the owner's field; NaN where it was not laid over it
  std::string sha256{};  ///< of the file's bytes
  Index width = 0;       ///< pixels
  Index height = 0;      ///< pixels
};

/// --reading auto|blind|geometry.
void add_reading(CLI::App& app, std::string& reading);

/// Reads pictures in the way that --reading names.
class SuspectReader {
 public:
  /// @param owner    must outlive this
  /// @param reading  auto: by geometry where the picture agrees with the owner's field. For preset paper auto
  /// is blind   @throws UsageError for geometry with preset paper
  SuspectReader(const watermark::Owner& owner, const std::string& reading);
  /// @param name  of the picture, for the result and for errors   @throws IoError if it is too small to be
  /// read
  PictureEvidence read(const Tensor<float>& picture, const std::string& name);

 private:
  watermark::PictureReader blind_;
  std::optional<watermark::GeometryReader> geometry_;
  bool forced_;
};

/// Reads the pictures that IMAGE|DIR... names. @throws IoError naming the picture that cannot be read
std::vector<PictureEvidence> read_pictures(SuspectReader& reader, const std::vector<std::string>& paths,
                                           Context& context);

/// The readings used: "blind", "geometry", or "mixed" where pictures differ.
std::string reading_used(const std::vector<PictureEvidence>& pictures);

/// Of all pictures together: views of one field are not independent trials, so their evidence is added.
std::vector<double> total_evidence(const std::vector<PictureEvidence>& pictures);

}  // namespace fieldmark::cli
