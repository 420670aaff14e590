#include "cli/surface.h"

#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace fieldmark::cli {
namespace {

using Eigen::Vector3f;

constexpr Index kLanes = 16, kBatch = 4096;  // positions evaluated together
constexpr float kEmpty = -7;                 // log density where there is no matter
constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

// The corners of a grid of n^3 cells.
struct Corners {
  Index n;
  Index side() const { return n + 1; }
  Index place(Index x, Index y, Index z) const { return x + side() * (y + side() * z); }
  float coordinate(Index i) const { return static_cast<float>(i) / static_cast<float>(n); }
};

// Evaluates a network at many positions, batch by batch, on several threads.
class Batches {
 public:
  template <class F>
  void run(Index count, F&& f) {
    parallel_for(kLanes, 1, [&](Index lane, Index) {
      for (Index begin = lane * kBatch; begin < count; begin += kLanes * kBatch) {
        tapes_[at(lane)].reset();
        f(tapes_[at(lane)], begin, std::min(kBatch, count - begin));
      }
    });
  }

 private:
  std::vector<Tape<float>> tapes_{at(kLanes)};  // they keep their memory
};

// Returns z of positions x [n, 3], and their features for the colour.
struct Geometry {
  Var<float> z, colour_features;
};
Geometry geometry_at(const nerf::RadianceField& field, Tape<float>& tape, const float* x, Index n) {
  const auto& net = field.field;
  float* density = tape.scratch(n * net.density_width());
  float* colour = tape.scratch(n * net.colour_width());
  net.encode(field.params, x, n, density, colour);
  const Params<float> params(field.params, nullptr);
  return {net.geometry(params, tape.constant(density, {n, net.density_width()})),
          tape.constant(colour, {n, net.colour_width()})};
}

// True if a corner lies in what an exported surface covers. Farther away, an unbounded scene is seen from one
// side only, and its cells are stretched.
bool in_export(nerf::SpaceKind kind, const Corners& corners, Index x, Index y, Index z) {
  const auto middle = [&](Index i) { return 4 * i >= corners.n && 4 * i <= 3 * corners.n; };
  if (kind == nerf::SpaceKind::contracted) return middle(x) && middle(y) && middle(z);
  return kind != nerf::SpaceKind::ndc || 20 * z <= 19 * corners.n;
}

// True if a corner touches an occupied cell of the grid.
bool near_matter(const nerf::OccupancyGrid& grid, const Corners& corners, Index x, Index y, Index z) {
  const Index r = grid.resolution();
  const auto range = [&](Index i) {
    const Index low = std::max<Index>(0, (i * r - 1) / corners.n);
    return std::array{low, std::min(r - 1, i * r / corners.n)};
  };
  const auto xs = range(x), ys = range(y), zs = range(z);
  for (Index k = zs[0]; k <= zs[1]; ++k)
    for (Index j = ys[0]; j <= ys[1]; ++j)
      for (Index i = xs[0]; i <= xs[1]; ++i)
        if (grid.occupied(grid.cell(i, j, k))) return true;
  return false;
}

// Writes the logarithms of the densities of one layer of corners: densities are exponentials, so the
// logarithm is what changes evenly between corners. Corners that are not exported get NaN.
void log_densities_of_layer(const nerf::RadianceField& field, const Corners& corners, Index z,
                            Batches& batches, float* layer) {
  std::vector<Index> places;
  std::vector<float> x;
  for (Index j = 0; j < corners.side(); ++j)
    for (Index i = 0; i < corners.side(); ++i) {
      const Index place = i + corners.side() * j;
      const bool exported = in_export(field.space.kind, corners, i, j, z);
      layer[place] = exported ? kEmpty : std::numeric_limits<float>::quiet_NaN();
      if (!exported || !near_matter(field.grid, corners, i, j, z)) continue;
      places.push_back(place);
      x.insert(x.end(), {corners.coordinate(i), corners.coordinate(j), corners.coordinate(z)});
    }
  batches.run(std::ssize(places), [&](Tape<float>& tape, Index begin, Index n) {
    const Var<float> sigma = field.field.density(geometry_at(field, tape, &x[at(3 * begin)], n).z);
    for (Index k = 0; k < n; ++k) layer[places[at(begin + k)]] = std::max(kEmpty, std::log(sigma.value()[k]));
  });
}

Vector3f vector_of(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }
std::array<float, 3> array_of(const Vector3f& v) { return {v[0], v[1], v[2]}; }

// Sets each vertex's normal to the mean of its triangles' ones, weighted by their areas.
void add_normals(Mesh& mesh) {
  std::vector<Vector3f> sums(mesh.positions.size(), Vector3f::Zero());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3f p = vector_of(mesh.positions[a]),
                   across = (vector_of(mesh.positions[b]) - p).cross(vector_of(mesh.positions[c]) - p);
    for (const std::uint32_t v : {a, b, c}) sums[v] += across;
  }
  for (const Vector3f& sum : sums)
    mesh.normals.push_back(array_of(sum.norm() > 0 ? Vector3f(sum / sum.norm()) : Vector3f(0, 0, 1)));
}

// Sets the colour of each vertex, whose positions in the cube are `x`, to that seen along its normal.
void add_colours(Mesh& mesh, const nerf::RadianceField& field, const std::vector<std::array<float, 3>>& x,
                 Batches& batches) {
  mesh.colours.resize(x.size());
  batches.run(std::ssize(x), [&](Tape<float>& tape, Index begin, Index n) {
    float* directions = tape.scratch(3 * n);
    for (Index k = 0; k < 3 * n; ++k) directions[k] = -mesh.normals[at(begin + k / 3)][at(k % 3)];
    const Geometry seen = geometry_at(field, tape, x[at(begin)].data(), n);
    const Var<float> rgb =
        field.field.colour(Params<float>(field.params, nullptr), seen.z, seen.colour_features,
                           field.field.encode_directions(tape.constant(directions, {n, 3})));
    for (Index k = 0; k < 3 * n; ++k) mesh.colours[at(begin + k / 3)][at(k % 3)] = rgb.value()[k];
  });
}

// The surface nets of a grid: vertices first, then the faces between them.
class Nets {
 public:
  Nets(const std::vector<float>& values, Index n, float level)
      : values_(values), corners_{n}, level_(level), vertex_(at(n * n * n), kNone) {}

  Mesh mesh() {
    const Index n = corners_.n;
    for (Index z = 0; z < n; ++z)
      for (Index y = 0; y < n; ++y)
        for (Index x = 0; x < n; ++x) add_vertex({x, y, z});
    for (Index z = 0; z < n; ++z)
      for (Index y = 0; y < n; ++y)
        for (Index x = 0; x < n; ++x)
          for (std::size_t axis = 0; axis < 3; ++axis) add_face({x, y, z}, axis);
    drop_vertices_without_faces();
    return std::move(mesh_);
  }

 private:
  using Place = std::array<Index, 3>;
  // True if the surface passes between two values; NaN is on no side of it.
  static bool crossed(float a, float b) { return a > 0 ? b <= 0 : a <= 0 && b > 0; }
  float value(const Place& p) const { return values_[at(corners_.place(p[0], p[1], p[2]))] - level_; }
  std::uint32_t& vertex(const Place& p) {
    return vertex_[at(p[0] + corners_.n * (p[1] + corners_.n * p[2]))];
  }

  void add_vertex(const Place& cell) {
    Vector3f sum = Vector3f::Zero();
    int crossings = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (Index side = 0; side < 4; ++side) {
        Place from = cell;
        from[(axis + 1) % 3] += side % 2;
        from[(axis + 2) % 3] += side / 2;
        Place to = from;
        ++to[axis];
        const float a = value(from), b = value(to);
        if (!crossed(a, b)) continue;
        Vector3f crossing(corners_.coordinate(from[0]), corners_.coordinate(from[1]),
                          corners_.coordinate(from[2]));
        crossing[static_cast<int>(axis)] += a / (a - b) / static_cast<float>(corners_.n);
        sum += crossing;
        ++crossings;
      }
    if (crossings == 0) return;
    vertex(cell) = static_cast<std::uint32_t>(mesh_.positions.size());
    mesh_.positions.push_back(array_of(sum / static_cast<float>(crossings)));
  }

  // Adds the face across the edge that begins at a corner and runs along an axis.
  void add_face(const Place& from, std::size_t axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    Place to = from;
    ++to[axis];
    const bool inside = value(from) > 0;
    if (from[u] == 0 || from[v] == 0 || !crossed(value(from), value(to))) return;
    std::array<std::uint32_t, 4> around{};
    constexpr Index kTurn[4][2] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}};
    for (std::size_t k = 0; k < 4; ++k) {
      Place cell = from;
      cell[u] -= kTurn[k][0];
      cell[v] -= kTurn[k][1];
      around[k] = vertex(cell);
    }
    if (!inside) std::ranges::reverse(around);
    mesh_.triangles.push_back({around[0], around[1], around[2]});
    mesh_.triangles.push_back({around[0], around[2], around[3]});
  }

  // The cells at the border of the grid have crossed edges, but not all of their faces.
  void drop_vertices_without_faces() {
    std::vector<std::uint32_t> place(mesh_.positions.size(), kNone);
    std::vector<std::array<float, 3>> kept;
    for (auto& triangle : mesh_.triangles)
      for (std::uint32_t& v : triangle) {
        if (place[v] == kNone) {
          place[v] = static_cast<std::uint32_t>(kept.size());
          kept.push_back(mesh_.positions[v]);
        }
        v = place[v];
      }
    mesh_.positions = std::move(kept);
  }

  const std::vector<float>& values_;
  Corners corners_;
  float level_;
  std::vector<std::uint32_t> vertex_;  // of each cell
  Mesh mesh_;
};

}  // namespace

Mesh surface_nets(const std::vector<float>& values, Index n, float level) {
  return Nets(values, n, level).mesh();
}

Mesh surface_of(const nerf::RadianceField& field, const SurfaceOptions& options,
                const std::function<bool(double part)>& proceed) {
  const Corners corners{options.resolution};
  if (corners.n < 8 || corners.n > 512)
    throw ValueError("[surface_of] resolution must be in [8, 512], got " + std::to_string(corners.n));
  if (!(options.density > 0) || !std::isfinite(options.density))
    throw ValueError("[surface_of] density must be positive, got " + std::to_string(options.density));
  const Index layer = corners.side() * corners.side();
  std::vector<float> logs(at(layer * corners.side()));
  Batches batches;
  for (Index z = 0; z < corners.side(); ++z) {
    if (proceed && !proceed(static_cast<double>(z) / static_cast<double>(corners.side()))) return {};
    log_densities_of_layer(field, corners, z, batches, &logs[at(layer * z)]);
  }
  Mesh mesh = surface_nets(logs, corners.n, static_cast<float>(std::log(options.density)));
  const auto in_cube = mesh.positions;
  mesh.origin = field.cameras.centre;
  for (auto& p : mesh.positions) {
    nerf::Vec3 x{};
    for (std::size_t a = 0; a < 3; ++a) x[a] = std::clamp<double>(p[a], 1e-4, 1 - 1e-4);  // ends may be far
    x = field.space.to_world(x);
    for (std::size_t a = 0; a < 3; ++a) p[a] = static_cast<float>(x[a] - mesh.origin[a]);
  }
  // Depth grows along the third axis of the cube of a forward-facing scene, and against that of the world.
  if (field.space.kind == nerf::SpaceKind::ndc)
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  add_normals(mesh);
  add_colours(mesh, field, in_cube, batches);
  return mesh;
}

}  // namespace fieldmark::cli
