#include "cli/surface.h"

#include <fieldmark/core/error.h>
#include <fieldmark/engine/parallel.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/tiny_job.h"
#include "tools/tiny_scene.h"

using namespace fieldmark;
using namespace fieldmark::cli;
using Eigen::Vector3d;

namespace {

Vector3d vec(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

// Values on the corners of n^3 cells.
template <class F>
std::vector<float> grid(Index n, F f) {
  std::vector<float> values;
  for (Index z = 0; z <= n; ++z)
    for (Index y = 0; y <= n; ++y)
      for (Index x = 0; x <= n; ++x)
        values.push_back(static_cast<float>(f(Vector3d(double(x), double(y), double(z)) / double(n))));
  return values;
}

struct Shape3 {
  double volume = 0, area = 0;
  bool closed = true;
};

// Volume by the divergence theorem, area, and whether each edge has one triangle on either side.
Shape3 measured(const Mesh& mesh) {
  Shape3 s;
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    const Vector3d a = vec(mesh.positions[t[0]]), b = vec(mesh.positions[t[1]]),
                   c = vec(mesh.positions[t[2]]);
    s.volume += a.dot(b.cross(c)) / 6;
    s.area += (b - a).cross(c - a).norm() / 2;
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges)
    s.closed = s.closed && count == 1 && edges.contains({edge.second, edge.first});
  return s;
}

}  // namespace

TEST_CASE("surface: the nets of a sphere have its volume and area, are closed and face outwards",
          "[export]") {
  const double r = 0.31;
  const Vector3d centre(0.5, 0.47, 0.52);
  for (const Index n : {24, 48}) {
    const Mesh mesh = surface_nets(grid(n, [&](const Vector3d& p) { return r - (p - centre).norm(); }), n, 0);
    const Shape3 s = measured(mesh);
    CHECK(s.closed);
    const double coarse = 24.0 * 24 / double(n * n);  // second order in the cell's side
    CHECK(s.volume == Approx(4 * std::numbers::pi / 3 * r * r * r).epsilon(0.025 * coarse));
    CHECK(s.area == Approx(4 * std::numbers::pi * r * r).epsilon(0.02 * coarse));
    for (const auto& p : mesh.positions) CHECK(std::abs((vec(p) - centre).norm() - r) < 0.005 * coarse);
  }
}

TEST_CASE("surface: a plane is met exactly, and nothing is where nothing crosses", "[export]") {
  const Mesh plane = surface_nets(
      grid(8, [](const Vector3d& p) { return p[2] < 0.3 ? 1 + (0.3 - p[2]) : 1 - (p[2] - 0.3); }), 8, 1);
  REQUIRE(plane.positions.size() == 64);  // all of them have a face
  for (const auto& p : plane.positions) CHECK(p[2] == Approx(0.3));
  CHECK(plane.triangles.size() == 2 * 7 * 7);
  CHECK(surface_nets(grid(8, [](const Vector3d&) { return 2.0; }), 8, 1).positions.empty());
  CHECK(surface_nets(grid(8, [](const Vector3d&) { return 0.0; }), 8, 1).triangles.empty());
}

TEST_CASE("surface: it ends where values are unknown", "[export]") {
  const auto values = [](bool known) {
    return grid(8, [=](const Vector3d& p) {
      return known || p[0] <= 0.5 ? 0.3 - p[2] : std::numeric_limits<double>::quiet_NaN();
    });
  };
  const Mesh all = surface_nets(values(true), 8, 0), part = surface_nets(values(false), 8, 0);
  CHECK(all.triangles.size() == 2 * 7 * 7);
  CHECK(part.triangles.size() == 2 * 4 * 7);  // the corners of edges at 0.125 to 0.5
  for (const auto& p : part.positions) CHECK(p[2] == Approx(0.3));
}

TEST_CASE("surface: normals point to where the density falls, in every space and of every kind of field",
          "[export]") {
  for (const auto kind : {nerf::SpaceKind::cube, nerf::SpaceKind::ndc, nerf::SpaceKind::contracted})
    for (const bool hash : {true, false}) {
      CAPTURE(nerf::name_of(kind), hash);
      nerf::RadianceField field = small_field(1, hash ? small_field_options() : small_mlp_options());
      field.space.kind = kind;
      field.space.near = 1;
      const auto density = [&](const nerf::Vec3& world) {
        const nerf::Vec3 x = field.space.to_cube(world);
        const float at[3] = {float(x[0]), float(x[1]), float(x[2])}, d[3] = {0, 0, 1};
        Tape<float> tape;
        return field
            .field(Params<float>(field.params, nullptr), tape.constant(at, {1, 3}), tape.constant(d, {1, 3}))
            .sigma.value()[0];
      };
      std::vector<double> densities;
      for (const nerf::Vec3& x :
           {nerf::Vec3{0.4, 0.4, 0.4}, {0.6, 0.4, 0.5}, {0.4, 0.6, 0.6}, {0.6, 0.6, 0.4}, {0.5, 0.5, 0.6}})
        densities.push_back(double(density(field.space.to_world(x))));
      std::ranges::sort(densities);
      const Mesh mesh = surface_of(field, {.resolution = 32, .density = densities[2]});
      REQUIRE(mesh.positions.size() > 20);
      std::size_t right = 0;
      for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        nerf::Vec3 in{}, out{};
        for (std::size_t a = 0; a < 3; ++a) {
          const double p = mesh.origin[a] + double(mesh.positions[i][a]),
                       step = 0.02 * double(mesh.normals[i][a]);
          in[a] = p - step, out[a] = p + step;
        }
        right += density(in) > density(out) ? 1 : 0;
      }
      CHECK(double(right) > 0.9 * double(mesh.positions.size()));
    }
}

TEST_CASE("surface: that of the built-in sphere is where the field's density is, with its colours",
          "[export]") {
  const TemporaryFolder folder;
  const auto field = nerf::RadianceField::load(tiny_field(folder, tiny_scene(folder)));
  const Mesh mesh = surface_of(field, {.resolution = 32, .density = 5});
  REQUIRE(mesh.triangles.size() > 100);
  REQUIRE(mesh.normals.size() == mesh.positions.size());
  REQUIRE(mesh.colours.size() == mesh.positions.size());
  Tape<float> tape;
  const Params<float> params(field.params, nullptr);
  std::size_t near = 0, outwards = 0;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    CHECK(vec(mesh.normals[i]).norm() == Approx(1));
    std::array<double, 3> p{};
    for (std::size_t a = 0; a < 3; ++a) p[a] = mesh.origin[a] + double(mesh.positions[i][a]);
    outwards += vec(mesh.normals[i]).dot(Vector3d(p[0], p[1], p[2])) > 0 ? 1 : 0;
    const nerf::Vec3 x = field.space.to_cube({p[0], p[1], p[2]});
    const float at[3] = {float(x[0]), float(x[1]), float(x[2])},
                d[3] = {-mesh.normals[i][0], -mesh.normals[i][1], -mesh.normals[i][2]};
    tape.reset();
    const auto seen = field.field(params, tape.constant(at, {1, 3}), tape.constant(d, {1, 3}));
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(mesh.colours[i][c] == Approx(seen.rgb.value()[c]).margin(2e-3));  // x is rounded on the way
    near += seen.sigma.value()[0] > 2.5 && seen.sigma.value()[0] < 10 ? 1 : 0;
  }
  CHECK(double(near) > 0.7 * double(mesh.positions.size()));      // densities are steep within a cell
  CHECK(double(outwards) > 0.6 * double(mesh.positions.size()));  // this field is hollow
  const ScopedThreads one(1);
  const Mesh again = surface_of(field, {.resolution = 32, .density = 5});
  CHECK(again.positions == mesh.positions);
  CHECK(again.colours == mesh.colours);
}

TEST_CASE("surface: stops on request, and refuses what is out of range", "[export]") {
  const TemporaryFolder folder;
  const auto field = nerf::RadianceField::load(tiny_field(folder, tiny_scene(folder)));
  int calls = 0;
  CHECK(surface_of(field, {.resolution = 8}, [&](double) { return ++calls < 3; }).positions.empty());
  CHECK(calls == 3);
  CHECK_THROWS_WITH(surface_of(field, {.resolution = 513}),
                    "[surface_of] resolution must be in [8, 512], got 513");
  CHECK_THROWS_WITH(surface_of(field, {.density = 0}), Contains("density must be positive, got 0"));
  CHECK_THROWS_WITH(surface_of(field, {.density = std::nan("")}), Contains("density must be positive"));
}
