#include "table_rows.h"

#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "checks.h"

namespace fieldmark::nerf {
namespace {

constexpr double kBeside = 1e-5;  // of the cube

// First and last corner, along an axis, of a level's cells that touch cell c of the grid.
struct Corners {
  Index first, last;
};
Corners touched(Index c, Index cells, Index resolution) {
  const double low = static_cast<double>(c) / static_cast<double>(cells) - kBeside,
               high = static_cast<double>(c + 1) / static_cast<double>(cells) + kBeside;
  const auto cell = [&](double x) {
    const auto i = static_cast<Index>(std::floor(x * static_cast<double>(resolution)));
    return std::clamp(i, Index{0}, resolution - 1);
  };
  return {cell(low), cell(high) + 1};
}

// Marks the rows of one level; `used` is the level's part.
void mark_level(const OccupancyGrid& grid, Index resolution, std::uint32_t mask,
                std::span<std::uint8_t> used) {
  const Index cells = grid.resolution();
  Index left = std::ssize(used);
  for (Index cell = 0; cell < grid.cells() && left > 0; ++cell) {
    if (!grid.occupied(cell)) continue;
    const std::array<Corners, 3> along{touched(cell % cells, cells, resolution),
                                       touched(cell / cells % cells, cells, resolution),
                                       touched(cell / (cells * cells), cells, resolution)};
    for (Index z = along[2].first; z <= along[2].last; ++z)
      for (Index y = along[1].first; y <= along[1].last; ++y)
        for (Index x = along[0].first; x <= along[0].last; ++x) {
          std::uint8_t& row = used[at(hash_row({x, y, z}, resolution, mask))];
          left -= row == 0;
          row = 1;
        }
  }
}

}  // namespace

std::vector<std::uint8_t> rows_in_use(const HashEncoding<float>& encoding, const OccupancyGrid& grid) {
  std::vector<std::uint8_t> used(at(encoding.rows()));
  parallel_for(encoding.levels(), 1, [&](Index l, Index) {
    const int level = static_cast<int>(l);
    const std::size_t first = at(encoding.first_row(level)), last = at(encoding.first_row(level + 1));
    mark_level(grid, encoding.resolution(level), encoding.mask(level),
               std::span(used).subspan(first, last - first));
  });
  return used;
}

}  // namespace fieldmark::nerf
