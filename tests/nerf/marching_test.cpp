#include "marching.h"
#include <fieldmark/nerf/space.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "support/catch.h"
#include "support/random.h"

using namespace fieldmark;
using namespace fieldmark::nerf;

namespace {
struct Line {
  float o[3], d[3];
};

OccupancyGrid random_grid(Index resolution, double filled, unsigned seed) {
  OccupancyGrid grid(resolution);
  const auto u = uniform({grid.cells()}, 0, 1, seed);
  std::vector<std::uint8_t> bits(static_cast<std::size_t>(grid.cells()));
  for (Index c = 0; c < grid.cells(); ++c) bits[static_cast<std::size_t>(c)] = u[c] < filled;
  grid.set_bits(bits);
  return grid;
}

std::vector<float> walk(const OccupancyGrid& grid, const Line& line, float step, float jitter,
                        Index max = 1000) {
  RayWalk ray(line.o, line.d, step, jitter);
  std::vector<float> all, t(static_cast<std::size_t>(max)), x(static_cast<std::size_t>(3 * max));
  for (Index count = max; count == max;) {
    count = ray.next(grid, max, t.data(), x.data());
    all.insert(all.end(), t.begin(), t.begin() + count);
    for (Index i = 0; i < 3 * count; ++i) {
      const auto a = static_cast<std::size_t>(i % 3), k = static_cast<std::size_t>(i);
      if (x[k] != line.o[a] + t[k / 3] * line.d[a]) FAIL("position " << i << " is not on the ray");
    }
  }
  return all;
}

// Every sample of the ray, classified cell by cell in double. `doubtful` holds those within 1e-4 of a cell's
// face or of the ray's ends, which rounding may put on either side.
struct Dense {
  std::vector<float> certain, doubtful;
};
Dense dense(const OccupancyGrid& grid, const Line& line, float step, float jitter) {
  Dense result;
  const CubeSpan span = intersect_unit_cube(line.o, line.d);
  const auto n = static_cast<double>(grid.resolution());
  for (Index k = 0; span.near < span.far; ++k) {
    const float t = span.near + (static_cast<float>(k) + jitter) * step;
    if (!(t < span.far)) break;
    bool near_face = t > span.far - 1e-5f;
    Index cell[3];
    for (int a = 0; a < 3; ++a) {
      const double p =
          n * (static_cast<double>(line.o[a]) + static_cast<double>(t) * static_cast<double>(line.d[a]));
      near_face |= line.d[a] != 0 && std::abs(p - std::round(p)) < 1e-4;
      cell[a] = std::min(std::max(static_cast<Index>(std::floor(p)), Index{0}), grid.resolution() - 1);
    }
    if (near_face)
      result.doubtful.push_back(t);
    else if (grid.occupied(grid.cell(cell[0], cell[1], cell[2])))
      result.certain.push_back(t);
  }
  return result;
}

// True if a sorted list contains t, up to the rounding of a multiply-add.
bool has(const std::vector<float>& sorted, float t) {
  const auto at = std::lower_bound(sorted.begin(), sorted.end(), t - 1e-6f);
  return at != sorted.end() && *at <= t + 1e-6f;
}

// Checks that the walk takes exactly the dense samples, except for doubtful ones. Returns the number of those
// that are certain.
std::size_t check_against_dense(const OccupancyGrid& grid, const Line& line, float step, float jitter) {
  const Dense want = dense(grid, line, step, jitter);
  const auto got = walk(grid, line, step, jitter);
  CAPTURE(line.o[0], line.o[1], line.o[2], line.d[0], line.d[1], line.d[2]);
  CHECK(std::is_sorted(got.begin(), got.end()));
  CHECK(std::all_of(want.certain.begin(), want.certain.end(), [&](float t) { return has(got, t); }));
  for (const float t : got) CHECK((has(want.certain, t) || has(want.doubtful, t)));
  CHECK(got.size() >= want.certain.size());
  CHECK(got.size() <= want.certain.size() + want.doubtful.size());
  return want.certain.size();
}

Line towards(const Tensor<double>& u, Index i) {
  Line line;
  double norm = 0;
  for (int a = 0; a < 3; ++a) norm += u[6 * i + 3 + a] * u[6 * i + 3 + a];
  for (int a = 0; a < 3; ++a) {
    line.o[a] = static_cast<float>(0.5 + 2 * u[6 * i + a]);
    line.d[a] = static_cast<float>(u[6 * i + 3 + a] / std::sqrt(norm));
  }
  return line;
}

// Returns a ray through the cube, from outside in two cases of three.
Line through_cube(const Tensor<double>& u, Index i) {
  Line line = towards(u, i);
  for (int a = 0; a < 3; ++a) line.o[a] = 0.5f + 0.25f * (line.o[a] - 0.5f) - (i % 3 ? 1.5f * line.d[a] : 0);
  return line;
}
}  // namespace

TEST_CASE("marching: span of a ray through the cube") {
  const auto span = [](Line l) { return intersect_unit_cube(l.o, l.d); };
  const CubeSpan across = span({{-1, 0.5f, 0.5f}, {1, 0, 0}});
  CHECK((across.near == 1 && across.far == 2));
  const CubeSpan inside = span({{0.25f, 0.5f, 0.5f}, {-1, 0, 0}});
  CHECK((inside.near == 0 && inside.far == 0.25f));
  const CubeSpan diagonal = span({{-1, -1, -1}, {0.57735027f, 0.57735027f, 0.57735027f}});
  CHECK(std::abs(diagonal.near - std::sqrt(3.f)) < 1e-6f);
  CHECK(std::abs(diagonal.far - 2 * std::sqrt(3.f)) < 1e-6f);
}

TEST_CASE("marching: rays that miss, point away, have no direction or are not numbers are empty") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const Line empty[] = {{{-1, 2, 0.5f}, {1, 0, 0}},      {{-1, 0.5f, 0.5f}, {-1, 0, 0}},
                        {{0.5f, 0.5f, 0.5f}, {0, 0, 0}}, {{2, 2, 2}, {0, 0, 0}},
                        {{nan, 0.5f, 0.5f}, {0, 0, 0}},  {{0.5f, 0.5f, -1}, {0, 0, nan}}};
  const OccupancyGrid grid(4);
  for (const Line& line : empty) {
    const CubeSpan span = intersect_unit_cube(line.o, line.d);
    CHECK_FALSE(span.near < span.far);
    CHECK(walk(grid, line, 0.01f, 0.5f).empty());
  }
}

TEST_CASE("marching: a ray in a face is inside, one beside it is not") {
  for (const float face : {0.f, 1.f}) {
    const Line in{{-1, face, 0.5f}, {1, 0, 0}};
    CHECK(intersect_unit_cube(in.o, in.d).far == 2);
    CHECK(walk(OccupancyGrid(8), in, 0.125f, 0.5f).size() == 8);
  }
  const Line out{{-1, std::nextafter(1.f, 2.f), 0.5f}, {1, 0, 0}};
  CHECK(intersect_unit_cube(out.o, out.d).far == 0);
}

TEST_CASE("marching: equal to dense stepping on random grids") {
  const auto u = uniform({150, 6}, -1, 1, 3);
  for (const double filled : {0.005, 0.1, 0.9}) {
    const OccupancyGrid grid = random_grid(16, filled, 2);
    std::size_t certain = 0;
    for (Index i = 0; i < 150; ++i)
      for (const Line& line : {towards(u, i), through_cube(u, i)})
        certain +=
            check_against_dense(grid, line, i % 2 == 0 ? 0.004f : 0.11f, 0.1f * static_cast<float>(i % 10));
    CAPTURE(filled);
    CHECK(certain > static_cast<std::size_t>(15000 * filled));
  }
}

TEST_CASE("marching: equal to dense stepping along the axes and from inside") {
  std::size_t certain = 0;
  for (const double filled : {0.05, 0.5}) {  // the sparse grid is empty along these rays
    const OccupancyGrid grid = random_grid(16, filled, 4);
    for (int axis = 0; axis < 3; ++axis)
      for (const float sign : {-1.f, 1.f})
        for (const float start : {-0.3f, 0.41f, 1.3f}) {
          Line line{{0.33f, 0.71f, 0.52f}, {0, 0, 0}};
          line.o[axis] = start;
          line.d[axis] = sign;
          certain += check_against_dense(grid, line, 0.003f, 0.37f);
        }
  }
  CHECK(certain > 1500);
}

TEST_CASE("marching: pieces of any length are the whole walk") {
  const OccupancyGrid grid = random_grid(16, 0.2, 5);
  const Line line = towards(uniform({1, 6}, -0.2, 0.2, 6), 0);
  const auto whole = walk(grid, line, 0.002f, 0.25f);
  CHECK(whole.size() > 10);
  for (const Index piece : {1, 3, 16}) CHECK(walk(grid, line, 0.002f, 0.25f, piece) == whole);
}

namespace {
// Checks that 200 walks give the same samples no matter how many of them skip empty cells first. Returns the
// number of walks with any samples.
Index seen_after_skipping(const OccupancyGrid& grid, const std::vector<RayWalk>& plain) {
  Index seen = 0;
  for (const Index count : {1, 16, 37, 200}) {
    std::vector<RayWalk> walks = plain;
    std::vector<Index> which;
    for (Index i = 0; i < count; ++i) which.push_back(199 - i);
    RayWalk::skip_empty(grid, walks, which);
    Index samples = 0;
    seen = 0;
    for (std::size_t i = 0; i < walks.size(); ++i) {
      RayWalk other = plain[i];
      std::vector<float> got(400), want(400), x(1200);
      got.resize(static_cast<std::size_t>(walks[i].next(grid, 400, got.data(), x.data())));
      want.resize(static_cast<std::size_t>(other.next(grid, 400, want.data(), x.data())));
      CHECK(got == want);
      samples += static_cast<Index>(want.size());
      seen += !want.empty();
    }
    CHECK(samples > 20);
  }
  return seen;
}
}  // namespace

TEST_CASE("marching: skipping empty cells first changes no sample, for any number of walks together") {
  const auto u = uniform({200, 6}, -1, 1, 8);
  std::vector<RayWalk> walks;
  for (Index i = 0; i < 200; ++i) {
    const Line line = through_cube(u, i);
    walks.emplace_back(line.o, line.d, i % 2 ? 0.003f : 0.02f, 0.3f);
  }
  const Index seen = seen_after_skipping(random_grid(64, 0.0005, 7), walks);
  CHECK((seen > 10 && seen < 100));  // and some rays see nothing
}

TEST_CASE("marching: contracted walks are brought to their first samples, near and far, and change none") {
  const auto u = uniform({200, 6}, -1, 1, 8);
  std::vector<RayWalk> walks;
  for (Index i = 0; i < 200; ++i) {
    const Line line = towards(u, i);
    walks.push_back(RayWalk::contracted(line.o, line.d, i % 2 ? 0.003f : 0.02f, 0.3f, 0.05f));
  }
  const Index seen = seen_after_skipping(random_grid(64, 0.0005, 7), walks);
  CHECK((seen > 5 && seen < 100));
}

TEST_CASE("marching: nothing is sampled in an empty grid") {
  CHECK(walk(random_grid(16, 0, 1), {{-1, 0.4f, 0.6f}, {1, 0, 0}}, 1e-3f, 0.5f).empty());
}

namespace {
// The expected samples of a contracted walk, step by step in double: t and, at least 1e-4 away from a cell's
// face, whether the cell is occupied.
struct Contracted {
  std::vector<double> t;
  std::vector<int> occupied;  // -1: too close to a face to tell
};
Contracted contracted_by_steps(const OccupancyGrid& grid, const Line& line, double step, double jitter,
                               double near) {
  Contracted all;
  const auto cells = static_cast<double>(grid.resolution());
  const auto scale = [&](double t) {
    double s = 1;
    for (int a = 0; a < 3; ++a)
      s = std::max(s,
                   4 * std::abs(static_cast<double>(line.o[a]) + t * static_cast<double>(line.d[a]) - 0.5));
    return s;
  };
  const Space space{.kind = SpaceKind::contracted, .bounds = {.corner = {0.25, 0.25, 0.25}, .side = 0.5}};
  for (double t = near + jitter * step * scale(near); scale(t) < static_cast<double>(kernels::kMarchFarthest);
       t += step * scale(t)) {
    Vec3 p;
    for (std::size_t a = 0; a < 3; ++a)
      p[a] = static_cast<double>(line.o[a]) + t * static_cast<double>(line.d[a]);
    Index cell[3];
    bool doubtful = false;
    for (std::size_t a = 0; a < 3; ++a) {
      const double c = cells * space.to_cube(p)[a];
      cell[a] = static_cast<Index>(c);
      doubtful |= std::abs(c - std::round(c)) < 1e-3;
    }
    all.t.push_back(t);
    all.occupied.push_back(doubtful ? -1 : grid.occupied(grid.cell(cell[0], cell[1], cell[2])));
  }
  return all;
}
}  // namespace

TEST_CASE("marching: a contracted walk finds the occupied samples of single steps, each t within 2e-5") {
  const auto u = uniform({60, 6}, -1, 1, 5);
  for (const double filled : {0.001, 0.1, 1.}) {
    const OccupancyGrid grid = random_grid(32, filled, 2);
    Index samples = 0;
    for (Index i = 0; i < 60; ++i) {
      const Line line = towards(u, i);
      const Contracted want = contracted_by_steps(grid, line, 0.01, 0.3, 0.05);
      RayWalk ray = RayWalk::contracted(line.o, line.d, 0.01f, 0.3f, 0.05f);
      float t[7], x[21];
      std::size_t k = 0;
      for (Index count = 7; count == 7;) {
        count = ray.next(grid, 7, t, x);
        samples += count;
        for (Index s = 0; s < count; ++s, ++k) {
          const auto same = [&] { return std::abs(static_cast<double>(t[s]) / want.t[k] - 1) < 2e-5; };
          for (; k < want.t.size() && !same(); ++k) REQUIRE(want.occupied[k] != 1);
          REQUIRE(k < want.t.size());
          REQUIRE(want.occupied[k] != 0);
          float p[3], c[3];
          for (int a = 0; a < 3; ++a) p[a] = line.o[a] + t[s] * line.d[a];
          contract(p, c);
          for (int a = 0; a < 3; ++a) CHECK(std::abs(x[3 * s + a] - c[a]) < 2e-7f);
        }
      }
      for (; k < want.t.size(); ++k) CHECK(want.occupied[k] != 1);
    }
    CHECK(samples > static_cast<Index>(6000 * filled));
  }
}

TEST_CASE("marching: contracted walks without a direction or with NaN end") {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const OccupancyGrid grid(8);
  std::vector<float> t(1 << 17), x(3 << 17);
  for (const Line& line :
       {Line{{0.5f, 0.5f, 0.5f}, {0, 0, 0}}, {{nan, 0.5f, 0.5f}, {1, 0, 0}}, {{2, 2, 2}, {nan, 0, 0}}}) {
    RayWalk ray = RayWalk::contracted(line.o, line.d, 0.01f, 0.5f, 0.1f);
    CHECK(ray.next(grid, 1 << 17, t.data(), x.data()) <= 1 << 16);
    for (const float v : x) REQUIRE((v >= 0 && v <= 1));
  }
}
