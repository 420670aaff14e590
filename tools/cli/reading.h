#pragma once
#include <fieldmark/watermark/reading/informed_reader.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// What one image or one frame of a video shows.
struct ImageEvidence {
  std::string image{};                                             ///< name; of a frame "clip.mp4@1.234s"
  std::vector<double> cells{};                                     ///< sign evidence S_c
  watermark::ReadingKind reading = watermark::ReadingKind::blind;  ///< where it comes from
  double agreement =
      std::nan("");              ///< of the image with the owner's field; NaN where it was not laid over it
  std::string sha256{};          ///< of the file's bytes
  Index width = 0;               ///< pixels
  Index height = 0;              ///< pixels
  std::filesystem::path file{};  ///< that it was read from
  double time = std::nan("");    ///< of a frame, seconds; NaN for an image
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
  /// As given: "auto", "blind" or "informed".
  const std::string& detection() const { return detection_; }
  /// Of the owner: the length of ImageEvidence::cells.
  Index cells() const { return cells_; }

 private:
  std::string detection_;
  Index cells_;
  watermark::BlindReader blind_;
  std::optional<watermark::InformedReader> informed_;
  bool forced_;
};

/// IMAGE|VIDEO|DIR..., the frames to sample of a video, and where readings are kept.
struct Suspects {
  std::vector<std::string> paths{};
  std::optional<Index> frames{};  ///< --frames if it was given
  std::string readings{};         ///< --readings: a file of KeptReadings; empty: none
};

/// The positional images, --frames and --readings. @param what  "Images to read"   @return the positional
/// argument
Option add_suspects(CommandLine& app, Suspects& suspects, const std::string& what);

/// Reads the images and frames of videos that IMAGE|VIDEO|DIR... names, one at a time, and leaves out those
/// that cannot be read, see Context::leave_out(). Images whose readings are kept are not read again; of
/// videos none are kept.
/// @param owner  the reader's file, for readings that are kept
/// @throws IoError if none can be read, naming the first   @throws UsageError for --frames without a video
std::vector<ImageEvidence> read_images(SuspectReader& reader, const Suspects& suspects,
                                       const std::filesystem::path& owner, Context& context);

/// The image or frame once more, as read_rgb(). @throws IoError
Tensor<float> read_again(const ImageEvidence& image, float background);

/// The readings used: "blind", "informed", or "mixed" where images differ.
std::string reading_used(const std::vector<ImageEvidence>& images);

/// Sum of the evidence of all images: views of one field are not independent trials.
std::vector<double> total_evidence(const std::vector<ImageEvidence>& images);

}  // namespace fieldmark::cli
