#include "cli/reading.h"

#include <fieldmark/engine/files.h>
#include <fieldmark/engine/image.h>
#include <fieldmark/watermark/digest.h>

#include "cli/cli.h"
#include "cli/context.h"
#include "cli/pictures.h"

namespace fieldmark::cli {
namespace {

PictureEvidence evidence_of(const watermark::PictureReader& reader, const std::filesystem::path& path) {
  const auto bytes = read_bytes(path);
  const Tensor<float> picture = decode_image(bytes, path.string());
  try {
    return {path.string(), reader.evidence(picture), watermark::sha256_hex(bytes), picture.shape[1],
            picture.shape[0]};
  } catch (const ShapeError& e) {
    throw IoError(path.string() + ": " + e.what());
  }
}

}  // namespace

std::vector<PictureEvidence> read_pictures(const watermark::Owner& owner,
                                           const std::vector<std::string>& paths, Context& context) {
  const auto pictures = list_pictures(paths);
  const watermark::PictureReader reader(owner);
  const InterruptGuard guard;
  Progress progress = context.progress("read");
  std::vector<PictureEvidence> read;
  for (const auto& path : pictures) {
    if (guard.interrupted()) throw Interrupted("nothing was decided");
    read.push_back(evidence_of(reader, path));
    progress.update(static_cast<double>(read.size()) / static_cast<double>(pictures.size()));
  }
  return read;
}

std::vector<double> total_evidence(const std::vector<PictureEvidence>& pictures) {
  std::vector<double> sum(pictures.front().cells.size(), 0.0);
  for (const auto& picture : pictures)
    for (std::size_t c = 0; c < sum.size(); ++c) sum[c] += picture.cells[c];
  return sum;
}

}  // namespace fieldmark::cli
