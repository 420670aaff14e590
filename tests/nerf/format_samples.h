#pragma once
// Small valid files in the formats that readers accept, for their tests and for the fuzzer.
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

template <class T>
std::string packed(const std::vector<T>& numbers) {
  std::string bytes(numbers.size() * sizeof(T), '\0');
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}
template <class T>
std::string packed(T number) {
  return packed(std::vector<T>{number});
}

inline std::string npy_file(std::string header, const std::string& data, char version = 1) {
  header += "\n";
  const std::string length = version == 1 ? packed(static_cast<std::uint16_t>(header.size()))
                                          : packed(static_cast<std::uint32_t>(header.size()));
  return std::string("\x93NUMPY") + version + '\0' + length + header + data;
}

/// Returns the rows of a poses_bounds.npy: cameras at (i, 0, 0) looking along -z with up y, 80 x 60 pixels,
/// focal length 70, bounds 2 + i and 10.
inline std::vector<double> llff_rows(int count) {
  std::vector<double> rows;
  for (int i = 0; i < count; ++i) {
    const double x = i;
    rows.insert(rows.end(), {0, 1, 0, x, 60, -1, 0, 0, 0, 80, 0, 0, 1, 0, 70, 2 + x, 10});
  }
  return rows;
}
inline std::string llff_file(const std::vector<double>& rows) {
  return npy_file(
      "{'descr': '<f8', 'fortran_order': False, 'shape': (" + std::to_string(rows.size() / 17) + ", 17), }",
      packed(rows));
}

// A COLMAP model of two cameras and three images, in both formats. Images 1 and 3 are at the origin and look
// along z; image 2 is rotated by 90 degrees about y.
inline const std::string kColmapCamerasText =
    "# Camera list\n1 OPENCV 80 60 70 71 40 30 0.01 -0.002 0.0003 0.0004\n\n2 SIMPLE_RADIAL 80 60 70 40 30 "
    "0.05\n";
inline const std::string kColmapImagesText =
    "# Image list\n"
    "1 1 0 0 0 0 0 0 1 b.png\n10.5 11.5 7 12 13 -1 14 15 9\n"
    "2 0.70710678118654752 0 0.70710678118654752 0 1 2 3 2 a.png\n\n"
    "3 1 0 0 0 0 0 -1 1 sub/c.png\n1 2 8\n";
inline std::string colmap_cameras_binary() {
  return packed(std::uint64_t{2}) + packed(std::uint32_t{1}) + packed(std::int32_t{4}) +
         packed(std::vector<std::uint64_t>{80, 60}) +
         packed(std::vector<double>{70, 71, 40, 30, 0.01, -0.002, 0.0003, 0.0004}) +
         packed(std::uint32_t{2}) + packed(std::int32_t{2}) + packed(std::vector<std::uint64_t>{80, 60}) +
         packed(std::vector<double>{70, 40, 30, 0.05});
}

inline std::string colmap_image_binary(std::uint32_t key, const std::vector<double>& pose,
                                       std::uint32_t camera, const std::string& name,
                                       const std::vector<std::int64_t>& points) {
  std::string bytes = packed(key) + packed(pose) + packed(camera) + name + '\0' +
                      packed(static_cast<std::uint64_t>(points.size()));
  for (const auto point : points) bytes += packed(std::vector<double>{10.5, 11.5}) + packed(point);
  return bytes;
}
inline std::string colmap_images_binary() {
  return packed(std::uint64_t{3}) + colmap_image_binary(1, {1, 0, 0, 0, 0, 0, 0}, 1, "b.png", {7, -1, 9}) +
         colmap_image_binary(2, {0.70710678118654752, 0, 0.70710678118654752, 0, 1, 2, 3}, 2, "a.png", {}) +
         colmap_image_binary(3, {1, 0, 0, 0, 0, 0, -1}, 1, "sub/c.png", {8});
}
