#include "cli/reading.h"

#include <fieldmark/core/digest.h>
#include <fieldmark/core/files.h>
#include <fieldmark/imaging/image.h>

#include <cstdio>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/images.h"

namespace fieldmark::cli {

using watermark::ReadingKind;

void add_reading(CommandLine& app, std::string& reading) {
  app.add_option("--detection", reading,
                 "blind: extractor alone; informed: find the camera and subtract the unmarked render;\n"
                 "auto: informed if the image agrees with the owner's field, else blind")
      ->one_of({"auto", "blind", "informed"})
      ->type_name("NAME");
}

void add_rate(CommandLine& app, double& rate, const std::string& what) {
  app.add_option("--fpr", rate, "False-positive rate at which " + what + ", above 0 to 1")
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

SuspectReader::SuspectReader(const watermark::Owner& owner, const std::string& reading)
    : blind_(owner), forced_(reading == "informed") {
  const bool has_cells = owner.mark().has_cells();
  if (forced_ && !has_cells)
    throw UsageError("--detection informed: an owner of preset " + owner.mark().preset() +
                     " has no cells in space");
  if (reading != "blind" && has_cells) informed_.emplace(owner);
}

ImageEvidence SuspectReader::read(const Tensor<float>& image, const std::string& name) {
  ImageEvidence out{.image = name, .cells = {}, .width = image.shape[1], .height = image.shape[0]};
  try {
    if (!informed_) {
      out.cells = blind_.evidence(image);
      return out;
    }
    const watermark::ImageReading r = informed_->read(image);
    out.agreement = r.informed.agreement;
    out.reading = forced_ && !r.informed.evidence.empty() ? ReadingKind::informed : r.chosen;
    out.cells = out.reading == ReadingKind::informed ? r.informed.evidence : r.blind;
    return out;
  } catch (const ShapeError& e) {
    throw IoError(name + ": " + e.what());
  }
}

std::vector<ImageEvidence> read_images(SuspectReader& reader, const std::vector<std::string>& paths,
                                       Context& context) {
  const auto images = list_images(paths, context);
  const InterruptGuard guard;
  Progress progress = context.progress("read");
  std::vector<ImageEvidence> read;
  ReadFaults faults;
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (guard.interrupted()) throw Interrupted("nothing was decided");
    faults.try_read(images[i], [&] {
      const std::string name = images[i].string();
      const auto bytes = read_bytes(images[i]);
      read.push_back(reader.read(decode_image(bytes, name), name));
      read.back().sha256 = sha256_hex(bytes);
      faults.check(images[i], bytes);
    });
    progress.update(static_cast<double>(i + 1) / static_cast<double>(images.size()));
  }
  faults.tell(images.size(), context);
  return read;
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
