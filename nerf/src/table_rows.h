#pragma once
#include <fieldmark/nerf/hash_encoding.h>
#include <fieldmark/nerf/occupancy_grid.h>

#include <cstdint>
#include <vector>

namespace fieldmark::nerf {

/// Finds the table rows that a position in an occupied cell can read: the corners of every level's cells that
/// touch an occupied cell enlarged by 1e-5 of the cube (rounding may put a position just outside its cell).
/// No render depends on the other rows. @return [rows] 1 where a row is read
std::vector<std::uint8_t> rows_in_use(const HashEncoding<float>& encoding, const OccupancyGrid& grid);

}  // namespace fieldmark::nerf
