#pragma once
#include <fieldmark/nerf/camera.h>

#include <filesystem>

#include "cli/surface.h"

namespace fieldmark::cli {

/// Writes the vertices of a mesh as a point cloud with normals and 8-bit colours: a binary, little-endian PLY
/// file. @throws IoError
void write_ply(const std::filesystem::path& path, const Mesh& mesh);

/// Writes a mesh as binary glTF 2.0 with unlit vertex colours. glTF's y axis is upwards; a node rotates `up`
/// onto it. glTF's colours are linear, so those of the mesh are converted from sRGB (IEC 61966-2-1).
/// @param up  unit, in the mesh's coordinates   @throws IoError   @throws ValueError if the file would
/// exceed 4 GB
void write_glb(const std::filesystem::path& path, const Mesh& mesh, const nerf::Vec3& up);

}  // namespace fieldmark::cli
