#include "cli/reading.h"

#include <fieldmark/engine/image.h>

#include "cli/cli.h"
#include "cli/pictures.h"

namespace fieldmark::cli {

Readings read_pictures(const watermark::Owner& owner, const std::vector<std::string>& paths,
                       Context& context) {
  Readings readings;
  readings.pictures = list_pictures(paths);
  readings.sum.assign(static_cast<std::size_t>(owner.cells.count()), 0.0);
  const watermark::PictureReader reader(owner);
  const InterruptGuard guard;
  Progress progress = context.progress("read");
  for (const auto& path : readings.pictures) {
    if (guard.interrupted()) throw Interrupted("while pictures were read");
    try {
      readings.each.push_back(reader.evidence(read_image(path)));
    } catch (const ShapeError& e) {
      throw IoError(path.string() + ": " + e.what());
    }
    for (std::size_t c = 0; c < readings.sum.size(); ++c) readings.sum[c] += readings.each.back()[c];
    progress.update(static_cast<double>(readings.each.size()) /
                    static_cast<double>(readings.pictures.size()));
  }
  return readings;
}

}  // namespace fieldmark::cli
