#pragma once
#include <cstddef>
#include <initializer_list>
#include <string>
#include <vector>

inline std::vector<std::byte> bytes_from(std::initializer_list<int> values) {
  std::vector<std::byte> out;
  for (int v : values) out.push_back(static_cast<std::byte>(v));
  return out;
}

inline void append(std::vector<std::byte>& to, const std::vector<std::byte>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// Returns a JPEG file with an EXIF segment after its start: one directory with a foreign entry and
/// Orientation.
/// @param big  byte order of the numbers: high to low ("MM") or low to high ("II")
inline std::vector<std::byte> with_orientation(const std::vector<std::byte>& jpeg, int orientation,
                                               bool big) {
  std::vector<std::byte> tiff =
      bytes_from(big ? std::initializer_list<int>{'M', 'M', 0, 42, 0, 0,           0, 8, 0, 2, 1,    0, 0,
                                                  3,   0,   0, 0,  1, 0,           7, 0, 0, 1, 0x12, 0, 3,
                                                  0,   0,   0, 1,  0, orientation, 0, 0, 0, 0, 0,    0}
                     : std::initializer_list<int>{'I', 'I', 42, 0, 8,           0, 0, 0, 2, 0,    0, 1, 3,
                                                  0,   1,   0,  0, 0,           7, 0, 0, 0, 0x12, 1, 3, 0,
                                                  1,   0,   0,  0, orientation, 0, 0, 0, 0, 0,    0, 0});
  std::vector<std::byte> file =
      bytes_from({0xff, 0xd8, 0xff, 0xe1, 0, static_cast<int>(8 + tiff.size()), 'E', 'x', 'i', 'f', 0, 0});
  append(file, tiff);
  file.insert(file.end(), jpeg.begin() + 2, jpeg.end());
  return file;
}
