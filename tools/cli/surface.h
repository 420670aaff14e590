#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace fieldmark::cli {

/// A triangle mesh with a normal and a colour for each vertex.
struct Mesh {
  nerf::Vec3 origin{};                                  ///< where position 0 lies, units of the scene
  std::vector<std::array<float, 3>> positions;          ///< from the origin, units of the scene
  std::vector<std::array<float, 3>> normals;            ///< unit, outwards
  std::vector<std::array<float, 3>> colours;            ///< in [0, 1], sRGB
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< vertices, counterclockwise seen from outside
};

/// Settings of surface_of().
struct SurfaceOptions {
  Index resolution = 256;  ///< cells per axis of the cube, 8 to 512
  /// Density of the surface, 1 / cube side, > 0. At 70, light loses half of its power within 1% of the cube.
  double density = 70;
};

/// Returns the surface on which a field has a density, with the colours that it shows when seen along the
/// normal. Where rays skip cells, the field counts as empty: densities below some 3 give the outline of those
/// cells. Covers the box in the middle of an unbounded scene, half of the grid along each axis, and a
/// forward-facing scene up to 20 times its least depth; the surface is open there. Takes 8 (resolution + 1)^3
/// bytes and some 150 for each vertex.
/// @param proceed  receives the part done, 0 to 1; returns false to stop, then the mesh is empty; may be
/// empty
/// @throws ValueError if an option is out of range
Mesh surface_of(const nerf::RadianceField& field, const SurfaceOptions& options,
                const std::function<bool(double part)>& proceed = {});

/// Returns the surface where values on a grid cross a level, by surface nets: one vertex in each cell that
/// the surface passes through, the mean of its crossings of the cell's edges, and a quadrilateral, cut in
/// two, for each crossed edge within the grid. Source: Gibson 1998, with the mean in place of a relaxation.
/// @param values  [n + 1, n + 1, n + 1] at the corners of n^3 cells, x fastest; inside is above the level.
/// The surface is open where a corner is NaN.
/// @return positions in the unit cube and triangles; no normals or colours
Mesh surface_nets(const std::vector<float>& values, Index n, float level);

}  // namespace fieldmark::cli
