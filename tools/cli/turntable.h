#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "cli/camera_path.h"

namespace fieldmark::cli {

/// Returns an HTML page that shows one image of a grid at a time; dragging and the arrow keys turn to its
/// neighbours. It needs no other file and no network.
/// @param jpegs  [rows, columns] files, in order of the cameras   @param title  plain text
/// @param dark  true for a black page
std::string turntable_page(const CameraGrid& grid, const std::vector<std::vector<std::byte>>& jpegs,
                           const std::string& title, bool dark);

}  // namespace fieldmark::cli
