#include "cli/reading.h"

#include <fieldmark/core/digest.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image_format.h>
#include <fieldmark/imaging/video/video_reader.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ostream>
#include <utility>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/images.h"
#include "cli/kept_readings.h"

namespace fieldmark::cli {

using watermark::ReadingKind;

constexpr Index kFrames = 16;  // per video

void add_reading(CommandLine& app, std::string& reading) {
  app.add_option("--detection", reading,
                 "Detection to use. blind: extractor alone; informed: find the camera and subtract the\n"
                 "unmarked render; "
                 "auto: informed if the image or a part of it agrees with the owner's field, else blind")
      ->one_of({"auto", "blind", "informed"})
      ->type_name("NAME");
}

void add_rate(CommandLine& app, double& rate, const std::string& what) {
  app.add_option("--fpr", rate, "False-positive rate at which " + what + ", 1e-300 to 1")
      ->range(1e-300, 1.0)
      ->type_name("P");
}

void check_rate(double rate, double least, Index cells) {
  if (least <= rate) return;
  char text[120];
  std::snprintf(text, sizeof text,
                "--fpr: with %lld cells no image can reach %g, the smallest p-value is %.1e",
                static_cast<long long>(cells), rate, least);
  throw UsageError(text);
}

bool is_video(const std::filesystem::path& file) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(file, ignored) && image_format(file) == ImageFormat::video;
}

SuspectReader::SuspectReader(const watermark::Owner& owner, const std::string& reading)
    : detection_(reading), cells_(owner.cells.count()), blind_(owner), forced_(reading == "informed") {
  const bool has_cells = owner.mark().has_cells();
  if (forced_ && !has_cells)
    throw UsageError("--detection informed: an owner of preset " + owner.mark().preset() +
                     " has no cells in space");
  if (reading != "blind" && has_cells) informed_.emplace(owner);
}

ImageEvidence SuspectReader::read(const Tensor<float>& image, const std::string& name) {
  using Clock = std::chrono::steady_clock;
  const auto begun = Clock::now();
  ImageEvidence out = detect(image, name);
  seconds_ += std::chrono::duration<double>(Clock::now() - begun).count();
  ++reads_;
  return out;
}

ImageEvidence SuspectReader::detect(const Tensor<float>& image, const std::string& name) {
  ImageEvidence out{.image = name, .cells = {}, .width = image.shape[1], .height = image.shape[0]};
  try {
    if (!informed_) {
      out.cells = blind_.evidence(image);
      return out;
    }
    watermark::PageReading r = informed_->read(image, forced_);
    if (forced_) r.force_informed();
    out.agreement = r.agreement();
    out.reading = r.chosen();
    out.cells = r.evidence();
    return out;
  } catch (const ShapeError& e) {
    throw IoError(name + ": " + e.what());
  }
}

Option add_suspects(CommandLine& app, Suspects& suspects, const std::string& what) {
  app.add_option("--frames", suspects.frames,
                 "Frames to sample of each video, evenly over its duration, 1 to 100000; default: 16")
      ->range(1, 100000)
      ->type_name("N")
      ->default_str("");
  app.add_option("--readings", suspects.readings,
                 "File of readings to reuse and extend, so that an interrupted run resumes; default: none")
      ->type_name("FILE")
      ->default_str("");
  return app
      .add_option("images", suspects.paths,
                  what + ", or folders of them; PNG, JPEG, WebP, AVIF, HEIC; videos MP4, MOV, WebM")
      ->type_name("IMAGE|VIDEO|DIR")
      ->default_str("");
}

namespace {

ImageEvidence read_still(SuspectReader& reader, const std::filesystem::path& file,
                         std::optional<KeptReadings>& kept, ReadFaults& faults) {
  const std::string name = file.string();
  const auto bytes = read_bytes(file);
  const std::string hash = sha256_hex(bytes);
  std::optional<ImageEvidence> known;
  if (kept) known = kept->find(hash);
  ImageEvidence read = known ? *known : reader.read(decode_upright(bytes, name), name);
  read.sha256 = hash;
  read.image = name;
  read.file = file;
  if (kept && !known) kept->add(read);
  faults.check(file, bytes);
  return read;
}

// Reads frames until one fails.
template <class F>
void read_video(SuspectReader& reader, const std::filesystem::path& file, Index count, ReadFaults& faults,
                std::vector<ImageEvidence>& read, const F& progress) {
  const std::string name = file.string(), hash = sha256_file_hex(name);
  VideoReader video(file);
  if (const std::string odd = video.oddity(); !odd.empty()) faults.warnings.push_back(name + ": " + odd);
  const auto times = video.sample_times(count);
  double last = -1;
  std::size_t frames = 0, damaged = 0;
  for (std::size_t k = 0; k < times.size(); ++k) {
    const VideoFrame frame = video.read_at(times[k]);
    // If a frame cannot be decoded, the reader returns another, perhaps one that was already read.
    if (frame.time > last) {
      char at[40];
      std::snprintf(at, sizeof at, "@%.3fs", frame.time);
      read.push_back(reader.read(frame.image, name + at));
      read.back().sha256 = hash, read.back().file = file, read.back().time = frame.time;
      ++frames, damaged += frame.damaged;
      last = frame.time;
    }
    progress(static_cast<double>(k + 1) / static_cast<double>(times.size()));
  }
  if (damaged > 0)
    faults.warnings.push_back(name + ": " + std::to_string(damaged) + " of " + std::to_string(frames) +
                              " frames are damaged; the decoder made up what the file lacks");
}

}  // namespace

std::vector<ImageEvidence> read_images(SuspectReader& reader, const Suspects& suspects,
                                       const std::filesystem::path& owner, Context& context) {
  const auto files = list_images(suspects.paths, context, Videos::read);
  if (suspects.frames && std::ranges::none_of(files, is_video))
    throw UsageError("--frames: there is no video among the images");
  if (!suspects.readings.empty() && std::ranges::all_of(files, is_video))
    throw UsageError("--readings: keeps readings of images, and there are only videos");
  std::optional<KeptReadings> kept;
  if (!suspects.readings.empty())
    kept.emplace(suspects.readings, sha256_file_hex(owner.string()), reader.detection(), reader.cells());
  if (kept && kept->size() > 0)
    context.text() << suspects.readings << ": readings of " << kept->size() << " images\n";
  const InterruptGuard guard;
  Progress progress = context.progress("read");
  std::vector<ImageEvidence> read;
  ReadFaults faults;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const auto done = [&](double share) {
      progress.update((static_cast<double>(i) + share) / static_cast<double>(files.size()));
      if (guard.interrupted())
        throw Interrupted(kept ? suspects.readings + " has readings of " + std::to_string(kept->size()) +
                                     " images; the same command resumes"
                               : "nothing was decided; --readings FILE lets a run resume");
    };
    done(0);
    faults.try_read(files[i], [&] {
      if (is_video(files[i]))
        read_video(reader, files[i], suspects.frames.value_or(kFrames), faults, read, done);
      else
        read.push_back(read_still(reader, files[i], kept, faults));
    });
    done(1);
  }
  faults.tell(!read.empty(), context);
  return read;
}

Tensor<float> read_again(const ImageEvidence& image, float background) {
  return std::isnan(image.time) ? read_rgb(image.file, background)
                                : VideoReader(image.file).read_at(image.time).image;
}

std::string reading_used(const std::vector<ImageEvidence>& images) {
  const ReadingKind first = images.front().reading;
  for (const auto& p : images)
    if (p.reading != first) return "mixed";
  return watermark::reading_name(first);
}

std::vector<double> total_evidence(const std::vector<ImageEvidence>& images) {
  std::vector<double> sum(images.front().cells.size(), 0.0);
  for (const auto& image : images)
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += image.cells[c];
  return sum;
}

}  // namespace fieldmark::cli
