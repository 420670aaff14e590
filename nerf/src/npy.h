#pragma once
#include <fieldmark/engine/shape.h>

#include <string_view>
#include <vector>

namespace fieldmark::nerf {

/// An array of NumPy's .npy file.
struct NpyArray {
  std::vector<Index> shape;     ///< extents, outermost first; empty for a single number
  std::vector<double> numbers;  ///< row-major, whatever the order of the file
};

/// Reads an .npy file of format 1, 2 or 3 whose elements are little-endian floats of 4 or 8 bytes, in C
/// or Fortran order.
/// @param name  stands for the path in errors
/// @throws IoError  naming the byte, what was expected and what was found: another format, element type
///                  (`descr`), a header that is not the three keys or longer than 4096 bytes, an extent below
///                  0, more or fewer bytes than the shape needs
NpyArray parse_npy(std::string_view bytes, std::string_view name);

}  // namespace fieldmark::nerf
