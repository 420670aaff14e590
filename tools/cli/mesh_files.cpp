#include "cli/mesh_files.h"

#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

namespace fieldmark::cli {
namespace {

static_assert(std::endian::native == std::endian::little);

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::uint16_t linear16(float srgb) {
  const double s = std::clamp<double>(srgb, 0, 1),
               linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535 * linear));
}

// Adds an array of the binary chunk and its accessor.
class GltfArrays {
 public:
  nlohmann::json views = nlohmann::json::array(), accessors = nlohmann::json::array();
  std::string bytes;

  // @param target  34962: vertices, 34963: indices   @param component  5123: 16-bit, 5125: 32-bit, 5126:
  // float
  template <class T>
  void add(const std::vector<T>& values, std::size_t count, const char* type, int component, int target) {
    views.push_back({{"buffer", 0},
                     {"byteOffset", bytes.size()},
                     {"byteLength", values.size() * sizeof(T)},
                     {"target", target}});
    accessors.push_back(
        {{"bufferView", views.size() - 1}, {"componentType", component}, {"count", count}, {"type", type}});
    for (const T& value : values) append(bytes, value);  // all sizes are multiples of 4
  }
};

// The node that moves a mesh to its origin and rotates `up` onto the y axis.
nlohmann::json node_of(const Mesh& mesh, const nerf::Vec3& up) {
  const auto q =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(up[0], up[1], up[2]), Eigen::Vector3d::UnitY());
  const Eigen::Vector3d t = q * Eigen::Vector3d(mesh.origin[0], mesh.origin[1], mesh.origin[2]);
  return {{"mesh", 0}, {"rotation", {q.x(), q.y(), q.z(), q.w()}}, {"translation", {t[0], t[1], t[2]}}};
}

void append_chunk(std::string& file, const char* type, const std::string& bytes, char filler) {
  const std::size_t padding = (4 - bytes.size() % 4) % 4;
  append(file, static_cast<std::uint32_t>(bytes.size() + padding));
  file.append(type, 4);
  file += bytes + std::string(padding, filler);
}

}  // namespace

void write_ply(const std::filesystem::path& path, const Mesh& mesh) {
  std::string file =
      "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(mesh.positions.size()) + "\n";
  for (const char* name : {"x", "y", "z"}) file += "property double " + std::string(name) + "\n";
  for (const char* name : {"nx", "ny", "nz"}) file += "property float " + std::string(name) + "\n";
  for (const char* name : {"red", "green", "blue"}) file += "property uchar " + std::string(name) + "\n";
  file += "end_header\n";
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (std::size_t a = 0; a < 3; ++a)
      append(file, mesh.origin[a] + static_cast<double>(mesh.positions[i][a]));
    append(file, mesh.normals[i]);
    for (const float c : mesh.colours[i])
      append(file, static_cast<std::uint8_t>(std::lround(255 * std::clamp(c, 0.f, 1.f))));
  }
  write_file_atomically(path, file);
}

void write_glb(const std::filesystem::path& path, const Mesh& mesh, const nerf::Vec3& up) {
  GltfArrays arrays;
  const std::size_t n = mesh.positions.size();
  arrays.add(mesh.positions, n, "VEC3", 5126, 34962);
  arrays.add(mesh.normals, n, "VEC3", 5126, 34962);
  std::vector<std::array<std::uint16_t, 4>> colours;
  for (const auto& c : mesh.colours)
    colours.push_back({linear16(c[0]), linear16(c[1]), linear16(c[2]), 65535});
  arrays.add(colours, n, "VEC4", 5123, 34962);
  arrays.add(mesh.triangles, 3 * mesh.triangles.size(), "SCALAR", 5125, 34963);
  std::array<float, 3> low = n ? mesh.positions[0] : std::array<float, 3>{}, high = low;
  for (const auto& p : mesh.positions)
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
  arrays.accessors[0]["min"] = low;
  arrays.accessors[0]["max"] = high;
  arrays.accessors[2]["normalized"] = true;
  const nlohmann::json scene = {{"asset", {{"version", "2.0"}, {"generator", "Fieldmark"}}},
                                {"extensionsUsed", {"KHR_materials_unlit"}},
                                {"scene", 0},
                                {"scenes", {{{"nodes", {0}}}}},
                                {"nodes", nlohmann::json::array({node_of(mesh, up)})},
                                {"materials",
                                 {{{"extensions", {{"KHR_materials_unlit", nlohmann::json::object()}}},
                                   {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}},
                                   {"doubleSided", true}}}},
                                {"meshes",
                                 {{{"primitives",
                                    {{{"attributes", {{"POSITION", 0}, {"NORMAL", 1}, {"COLOR_0", 2}}},
                                      {"indices", 3},
                                      {"material", 0}}}}}}},
                                {"buffers", {{{"byteLength", arrays.bytes.size()}}}},
                                {"bufferViews", arrays.views},
                                {"accessors", arrays.accessors}};
  std::string chunks;
  append_chunk(chunks, "JSON", scene.dump(), ' ');
  append_chunk(chunks, "BIN\0", arrays.bytes, '\0');
  if (chunks.size() > std::numeric_limits<std::uint32_t>::max() - 12)
    throw ValueError(path.string() + ": a GLB file holds at most 4 GB, the mesh has " +
                     std::to_string(mesh.positions.size()) + " vertices; choose a lower resolution");
  std::string file = "glTF";
  append(file, std::uint32_t{2});
  append(file, static_cast<std::uint32_t>(12 + chunks.size()));
  write_file_atomically(path, file + chunks);
}

}  // namespace fieldmark::cli
