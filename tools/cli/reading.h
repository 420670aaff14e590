#pragma once
#include <fieldmark/watermark/scanning/page_reader.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// The reading of one image or one video frame.
struct ImageEvidence {
  std::string image{};                                             ///< name; for a frame "clip.mp4@1.234s"
  std::vector<double> cells{};                                     ///< evidence per cell, S_c
  watermark::ReadingKind reading = watermark::ReadingKind::blind;  ///< detection that produced it
  /// Of the image, or of a part of it, with the owner's field; NaN if they were not aligned.
  double agreement = std::nan("");
  std::string sha256{};          ///< of the file's bytes
  Index width = 0;               ///< pixels
  Index height = 0;              ///< pixels
  std::filesystem::path file{};  ///< the file it was read from
  double time = std::nan("");    ///< of a frame, seconds; NaN for an image
};

/// Adds --detection auto|blind|informed.
void add_reading(CommandLine& app, std::string& reading);

/// Adds --fpr. @param what  happens at this rate: "a mark counts as found"
void add_rate(CommandLine& app, double& rate, const std::string& what);

/// Rejects a rate that no image can reach.
/// @param least  least p-value with this number of cells   @throws UsageError
void check_rate(double rate, double least, Index cells);

/// True if a file is a video, whatever its name. @throws IoError if it cannot be read
bool is_video(const std::filesystem::path& file);

/// Reads images with the detection that --detection names.
class SuspectReader {
 public:
  /// @param owner    must outlive this
  /// @param reading  auto: informed if the image agrees with the owner's field; blind for preset paper
  /// @throws UsageError for informed with preset paper
  SuspectReader(const watermark::Owner& owner, const std::string& reading);
  /// @param name  of the image, for the result and error messages   @throws IoError if it is too small
  ImageEvidence read(const Tensor<float>& image, const std::string& name);
  /// Returns the mean wall time of read() in seconds; NaN if it has read no image.
  double seconds_per_image() const {
    return reads_ > 0 ? seconds_ / static_cast<double>(reads_) : std::nan("");
  }
  /// Returns the option as given: "auto", "blind" or "informed".
  const std::string& detection() const { return detection_; }
  /// Returns the owner's number of cells: the length of ImageEvidence::cells.
  Index cells() const { return cells_; }

 private:
  ImageEvidence detect(const Tensor<float>& image, const std::string& name);
  std::string detection_;
  Index cells_;
  watermark::BlindReader blind_;
  std::optional<watermark::PageReader> informed_;
  bool forced_;
  double seconds_ = 0;  // of all reads
  Index reads_ = 0;
};

/// IMAGE|VIDEO|DIR..., the number of frames to sample per video, and the file of readings.
struct Suspects {
  std::vector<std::string> paths{};
  std::optional<Index> frames{};  ///< --frames, if given
  std::string readings{};         ///< --readings: a file of KeptReadings; empty: none
};

/// Adds the positional images, --frames and --readings. @param what  "Images to read"
/// @return the positional argument
Option add_suspects(CommandLine& app, Suspects& suspects, const std::string& what);

/// Reads the images and video frames of IMAGE|VIDEO|DIR... one at a time, and leaves out those that cannot be
/// read, see Context::leave_out(). Images with stored readings are not read again; readings of videos are not
/// stored.
/// @param owner  the reader's file, for stored readings
/// @throws IoError if none can be read, naming the first   @throws UsageError for --frames without a video
std::vector<ImageEvidence> read_images(SuspectReader& reader, const Suspects& suspects,
                                       const std::filesystem::path& owner, Context& context);

/// Reads the image or frame again, as read_rgb(). @throws IoError
Tensor<float> read_again(const ImageEvidence& image, float background);

/// Returns the detection used: "blind", "informed", or "mixed" if images differ.
std::string reading_used(const std::vector<ImageEvidence>& images);

/// Sums the evidence of all images: views of one field are not independent trials.
std::vector<double> total_evidence(const std::vector<ImageEvidence>& images);

}  // namespace fieldmark::cli
