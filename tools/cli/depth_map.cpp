#include "cli/depth_map.h"

#include <fieldmark/core/files.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <string>
#include <vector>

namespace fieldmark::cli {
namespace {

// Returns how far in front of a camera a position in the cube lies.
float along_view(const nerf::Camera& camera, const nerf::Space& space, const float* x) {
  const nerf::Vec3 p = space.to_world({x[0], x[1], x[2]}), eye = camera.position(),
                   forward = camera.forward();
  double distance = 0;
  for (std::size_t a = 0; a < 3; ++a) distance += (p[a] - eye[a]) * forward[a];
  return static_cast<float>(distance);
}

}  // namespace

Tensor<float> depth_map(const nerf::RadianceField& field, nerf::Renderer& renderer,
                        const nerf::Camera& camera, const Tensor<float>& opacity) {
  constexpr Index kChunk = 256;  // rays traced together
  Tensor<float> depth({camera.height, camera.width});
  const Index pixels = depth.size();
  renderer.refresh();
  parallel_for(nerf::Renderer::kLanes, 1, [&](Index lane, Index) {
    std::vector<float> places, seen(at(4 * kChunk)), position(at(3 * kChunk));
    nerf::CubeRays rays;
    for (Index first = lane * kChunk; first < pixels; first += nerf::Renderer::kLanes * kChunk) {
      const Index n = std::min(kChunk, pixels - first);
      places.clear();
      for (Index i = first; i < first + n; ++i)
        places.insert(places.end(),
                      {static_cast<float>(i % camera.width), static_cast<float>(i / camera.width)});
      rays.resize(n);
      rays.set(field.space, 0, camera, places);
      renderer.trace(rays.batch(field.space), lane, seen.data(), position.data());
      for (Index i = 0; i < n; ++i)
        depth[first + i] = opacity[first + i] < 0.5f || !(seen[at(4 * i + 3)] > 0)
                               ? std::numeric_limits<float>::quiet_NaN()
                               : along_view(camera, field.space, &position[at(3 * i)]);
    }
  });
  return depth;
}

void write_npy(const std::filesystem::path& path, const Tensor<float>& values) {
  static_assert(std::endian::native == std::endian::little);
  std::string shape;
  for (int k = 0; k < values.shape.rank(); ++k) shape += std::to_string(values.shape[k]) + ", ";
  std::string header = "{'descr': '<f4', 'fortran_order': False, 'shape': (" + shape + "), }";
  const std::size_t before = 10;  // magic, version, length
  header.append(63 - (before + header.size()) % 64, ' ');
  header += '\n';
  std::string file = "\x93NUMPY";
  file += {'\x01', '\x00', static_cast<char>(header.size() % 256), static_cast<char>(header.size() / 256)};
  file += header;
  file.append(reinterpret_cast<const char*>(values.data.data()), values.data.size() * sizeof(float));
  write_file_atomically(path, file);
}

}  // namespace fieldmark::cli
