#include "cli/reading.h"

#include <fieldmark/engine/files.h>
#include <fieldmark/engine/image.h>
#include <fieldmark/watermark/digest.h>

#include <CLI/CLI.hpp>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/pictures.h"

namespace fieldmark::cli {

using watermark::ReadingKind;

void add_reading(CLI::App& app, std::string& reading) {
  app.add_option(
         "--reading", reading,
         "blind: the extractor alone; geometry: find the camera, subtract the owner's unmarked view;\n"
         "auto: geometry where the picture agrees with the owner's field, else blind")
      ->check(CLI::IsMember({"auto", "blind", "geometry"}).description(""))
      ->type_name("NAME");
}

SuspectReader::SuspectReader(const watermark::Owner& owner, const std::string& reading)
    : blind_(owner), forced_(reading == "geometry") {
  if (forced_ && !owner.reader)
    throw UsageError("--reading geometry: an owner of preset paper has no cells in space");
  if (reading != "blind" && owner.reader) geometry_.emplace(owner);
}

PictureEvidence SuspectReader::read(const Tensor<float>& picture, const std::string& name) {
  PictureEvidence out{.image = name, .cells = {}, .width = picture.shape[1], .height = picture.shape[0]};
  try {
    if (!geometry_) {
      out.cells = blind_.evidence(picture);
      return out;
    }
    const watermark::PictureReading r = geometry_->read(picture);
    out.agreement = r.geometry.agreement;
    out.reading = forced_ && !r.geometry.evidence.empty() ? ReadingKind::geometry : r.chosen;
    out.cells = out.reading == ReadingKind::geometry ? r.geometry.evidence : r.blind;
    return out;
  } catch (const ShapeError& e) {
    throw IoError(name + ": " + e.what());
  }
}

std::vector<PictureEvidence> read_pictures(SuspectReader& reader, const std::vector<std::string>& paths,
                                           Context& context) {
  const auto pictures = list_pictures(paths);
  const InterruptGuard guard;
  Progress progress = context.progress("read");
  std::vector<PictureEvidence> read;
  for (const auto& path : pictures) {
    if (guard.interrupted()) throw Interrupted("nothing was decided");
    const auto bytes = read_bytes(path);
    read.push_back(reader.read(decode_image(bytes, path.string()), path.string()));
    read.back().sha256 = watermark::sha256_hex(bytes);
    progress.update(static_cast<double>(read.size()) / static_cast<double>(pictures.size()));
  }
  return read;
}

std::string reading_used(const std::vector<PictureEvidence>& pictures) {
  const ReadingKind first = pictures.front().reading;
  for (const auto& p : pictures)
    if (p.reading != first) return "mixed";
  return watermark::reading_name(first);
}

std::vector<double> total_evidence(const std::vector<PictureEvidence>& pictures) {
  std::vector<double> sum(pictures.front().cells.size(), 0.0);
  for (const auto& picture : pictures)
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += picture.cells[c];
  return sum;
}

}  // namespace fieldmark::cli
