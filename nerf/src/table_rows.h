#pragma once
#include <fieldmark/nerf/hash_encoding.h>
#include <fieldmark/nerf/occupancy_grid.h>

#include <cstdint>
#include <vector>

namespace fieldmark::nerf {

/// Which rows of a table a look-up inside an occupied cell can read: the corners of the cells of every level
/// that touch one, enlarged by 1e-5 of the cube for positions that rounding puts beside their cell. The
/// others carry nothing: no image depends on them.
/// @return [rows] 1 where a row is read
std::vector<std::uint8_t> rows_in_use(const HashEncoding<float>& encoding, const OccupancyGrid& grid);

}  // namespace fieldmark::nerf
