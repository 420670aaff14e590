#pragma once
#include <fieldmark/watermark/reading/informed_reader.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// What one image shows.
struct ImageEvidence {
  std::string image;
  std::vector<double> cells;                                       ///< sign evidence S_c
  watermark::ReadingKind reading = watermark::ReadingKind::blind;  ///< where it comes from
  double agreement =
      std::nan("");      ///< of the image with the owner's field; NaN where it was not laid over it
  std::string sha256{};  ///< of the file's bytes
  Index width = 0;       ///< pixels
  Index height = 0;      ///< pixels
};

/// --detection auto|blind|informed.
void add_reading(CommandLine& app, std::string& reading);

/// --fpr. @param what  happens at this rate: "a mark counts as found"
void add_rate(CommandLine& app, double& rate, const std::string& what);

/// Refuses a rate that no image can reach. @param least  p-value with so many cells   @throws UsageError
void check_rate(double rate, double least, Index cells);

/// Reads images in the way that --detection names.
class SuspectReader {
 public:
  /// @param owner    must outlive this
  /// @param reading  auto: informed where the image agrees with the owner's field. For preset paper auto
  /// is blind   @throws UsageError for informed with preset paper
  SuspectReader(const watermark::Owner& owner, const std::string& reading);
  /// @param name  of the image, for the result and for errors   @throws IoError if it is too small to be
  /// read
  ImageEvidence read(const Tensor<float>& image, const std::string& name);

 private:
  watermark::BlindReader blind_;
  std::optional<watermark::InformedReader> informed_;
  bool forced_;
};

/// Reads the images that IMAGE|DIR... names and leaves out those that cannot be read, see
/// Context::leave_out().
/// @throws IoError if none can be read, naming the first
std::vector<ImageEvidence> read_images(SuspectReader& reader, const std::vector<std::string>& paths,
                                       Context& context);

/// The readings used: "blind", "informed", or "mixed" where images differ.
std::string reading_used(const std::vector<ImageEvidence>& images);

/// Sum of the evidence of all images: views of one field are not independent trials.
std::vector<double> total_evidence(const std::vector<ImageEvidence>& images);

}  // namespace fieldmark::cli
