#include <fieldmark/engine/shape_checks.h>
#include <fieldmark/watermark/scanning/image_blocks.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace fieldmark::watermark {
namespace {

constexpr float kBackground = 0.1f;    // in every channel: more than JPEG changes beside letters
constexpr double kLeastOfImage = 0.1;  // share of all pixels that a background has at least
constexpr Index kLevels = 16;          // of a channel, in the count of colours
constexpr Index kGapShare = 100, kLeastGap = 4;

// Returns the mean colour in the fullest cell of a count of colours.
std::optional<std::array<float, 3>> background_of(const Tensor<float>& rgb) {
  struct Cell {
    Index count = 0;
    std::array<double, 3> sum{};
  };
  std::vector<Cell> cells(static_cast<std::size_t>(kLevels * kLevels * kLevels));
  const Index pixels = rgb.shape[0] * rgb.shape[1];
  for (Index p = 0; p < pixels; ++p) {
    Index at = 0;
    for (Index c = 0; c < 3; ++c) {
      const float value = std::clamp(std::isfinite(rgb[3 * p + c]) ? rgb[3 * p + c] : 0.f, 0.f, 1.f);
      const auto level = static_cast<Index>(value * static_cast<float>(kLevels));
      at = kLevels * at + std::min(level, kLevels - 1);
    }
    Cell& cell = cells[static_cast<std::size_t>(at)];
    ++cell.count;
    for (std::size_t c = 0; c < 3; ++c)
      cell.sum[c] += static_cast<double>(rgb[3 * p + static_cast<Index>(c)]);
  }
  const Cell& most = *std::ranges::max_element(cells, {}, &Cell::count);
  if (static_cast<double>(most.count) < kLeastOfImage * static_cast<double>(pixels)) return std::nullopt;
  std::array<float, 3> mean{};
  for (std::size_t c = 0; c < 3; ++c)
    mean[c] = static_cast<float>(most.sum[c] / static_cast<double>(most.count));
  return mean;
}

using Lines = std::vector<std::uint8_t>;  // of a box: 1 for a row or column with something on it
using Run = std::pair<Index, Index>;      // [first, end)

// Returns the runs of lines with something on them, divided where `gap` lines or more are plain.
std::vector<Run> runs(const Lines& lines, Index gap) {
  std::vector<Run> found;
  for (Index i = 0; i < std::ssize(lines); ++i) {
    if (!lines[static_cast<std::size_t>(i)]) continue;
    if (found.empty() || i - found.back().second >= gap)
      found.emplace_back(i, i + 1);
    else
      found.back().second = i + 1;
  }
  return found;
}

class Cutter {
 public:
  Cutter(const Tensor<float>& rgb, const std::array<float, 3>& background, Index least)
      : width_(rgb.shape[1]),
        gap_(std::max(kLeastGap, std::min(rgb.shape[0], rgb.shape[1]) / kGapShare)),
        least_(least),
        differs_(static_cast<std::size_t>(rgb.shape[0] * rgb.shape[1])) {
    for (Index p = 0; p < std::ssize(differs_); ++p)
      for (std::size_t c = 0; c < 3; ++c)
        if (!(std::abs(rgb[3 * p + static_cast<Index>(c)] - background[c]) <= kBackground))
          differs_[static_cast<std::size_t>(p)] = 1;
  }

  ImageBlock cut(const PixelBox& all) const {
    const PixelBox box = trimmed(all);
    if (box.area() == 0) return {};
    for (const bool rows : {true, false}) {
      const std::vector<Run> pieces = runs(lines(box, rows), gap_);
      if (pieces.size() > 1) return divided(box, rows, pieces);
    }
    return {box, {}};
  }

 private:
  ImageBlock divided(const PixelBox& box, bool rows, const std::vector<Run>& pieces) const {
    ImageBlock block{box, {}};
    for (const auto& [first, end] : pieces) {
      const PixelBox piece = rows ? PixelBox{box.x, box.y + first, box.width, end - first}
                                  : PixelBox{box.x + first, box.y, end - first, box.height};
      ImageBlock part = cut(piece);
      if (std::min(part.box.width, part.box.height) >= least_) block.parts.push_back(std::move(part));
    }
    // What is too small is left out. A single other part is the block.
    if (block.parts.size() == 1) return ImageBlock(std::move(block.parts.front()));
    return block;
  }

  Lines lines(const PixelBox& box, bool rows) const {
    Lines found(static_cast<std::size_t>(rows ? box.height : box.width));
    for (Index y = 0; y < box.height; ++y)
      for (Index x = 0; x < box.width; ++x)
        found[static_cast<std::size_t>(rows ? y : x)] |=
            differs_[static_cast<std::size_t>((box.y + y) * width_ + box.x + x)];
    return found;
  }

  // The smallest box around all that differs; empty if nothing does.
  PixelBox trimmed(const PixelBox& box) const {
    const auto ends = [](const Lines& lines) {
      const std::vector<Run> whole = runs(lines, std::ssize(lines) + 1);
      return whole.empty() ? Run{0, 0} : whole.front();
    };
    const auto [top, bottom] = ends(lines(box, true));
    const auto [left, right] = ends(lines(box, false));
    return {box.x + left, box.y + top, right - left, bottom - top};
  }

  Index width_, gap_, least_;
  Lines differs_;  // [H W] 1 where a pixel is not background
};

}  // namespace

ImageBlocks image_blocks(const Tensor<float>& rgb, Index least) {
  check_rank("image_blocks", "rgb", rgb.shape, 3, "[height, width, 3]");
  check_extent("image_blocks", "rgb", rgb.shape, 2, 3, "red, green and blue");
  if (least < 1) throw ValueError("[image_blocks] least must be at least 1, got " + std::to_string(least));
  const PixelBox all{0, 0, rgb.shape[1], rgb.shape[0]};
  const auto background = background_of(rgb);
  if (!background) return {.all = {all, {}}};
  return {Cutter(rgb, *background, least).cut(all), *background};
}

}  // namespace fieldmark::watermark
