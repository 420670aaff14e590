#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>
#include <fieldmark/watermark/mark/cell_grid.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace fieldmark::watermark {
namespace {

constexpr float kSteepness = 3;

void check_side(Index side) {
  if (side < 2 || side > 64)
    throw ValueError("[cell_grid] side must be 2 to 64 cells, got " + std::to_string(side));
}

}  // namespace

CellGrid::CellGrid(Index side, std::span<const double> area, double least) : side_(side) {
  check_side(side);
  if (static_cast<Index>(area.size()) != side * side * side)
    throw ShapeError("[cell_grid] area must have " + std::to_string(side * side * side) + " entries, got " +
                     std::to_string(area.size()));
  const double total = std::accumulate(area.begin(), area.end(), 0.0);
  for (double a : area) {
    const bool is_cell = total > 0 && a > least * total;
    numbers_.push_back(is_cell ? static_cast<std::int32_t>(area_.size()) : -1);
    if (is_cell) area_.push_back(a / total);
  }
  if (area_.empty()) throw ValueError("[cell_grid] area must be positive somewhere: no view shows anything");
}

CellGrid CellGrid::from_numbers(Index side, std::span<const std::int32_t> numbers,
                                std::span<const double> area) {
  check_side(side);
  if (area.empty()) throw ValueError("[cell_grid] area must be of at least one cell, got none");
  CellGrid grid;
  grid.side_ = side;
  grid.numbers_.assign(numbers.begin(), numbers.end());
  grid.area_.assign(area.begin(), area.end());
  std::int32_t next = 0;
  const bool ordered =
      std::all_of(numbers.begin(), numbers.end(), [&](std::int32_t n) { return n == -1 || n == next++; });
  if (static_cast<Index>(numbers.size()) != side * side * side || !ordered ||
      next != static_cast<std::int32_t>(area.size()))
    throw ValueError("[cell_grid] numbers must count " + std::to_string(area.size()) +
                     " cells in the order of a grid of " + std::to_string(side) + " a side");
  return grid;
}

void CellGrid::set_strength(std::vector<std::int32_t> strength) {
  if (std::ssize(strength) % count() != 0)
    throw ShapeError("[cell_grid] strength must have " + std::to_string(count()) +
                     " numbers for each view, one a cell, got " + std::to_string(strength.size()));
  for (const std::int32_t s : strength) check_number("cell_grid", "strength", s, s >= 0, "at least 0");
  strength_ = std::move(strength);
}

Index CellGrid::place(Index side, const float x[3]) {
  Index c[3];
  for (int a = 0; a < 3; ++a) {
    const float p = x[a] * static_cast<float>(side);
    c[a] = p > 0 ? std::min(static_cast<Index>(std::min(p, 1e6f)), side - 1) : 0;  // NaN goes to cell 0
  }
  return c[0] + side * (c[1] + side * c[2]);
}

// Returns the cells around a position with their trilinear weights, each cell once.
CellGrid::Near CellGrid::near(const float* x) const {
  Index base[3];
  float f[3];
  for (int a = 0; a < 3; ++a) {
    // As in place(), NaN goes to cell 0: casting NaN to an integer would be undefined.
    const float inside = x[a] > 0 ? std::min(x[a], 1.f) : 0.f;
    const float p = inside * static_cast<float>(side_) - 0.5f;
    base[a] = static_cast<Index>(std::floor(p));
    f[a] = p - static_cast<float>(base[a]);
  }
  Near out;
  float total = 0;
  for (int k = 0; k < 8; ++k) {
    float w = 1;
    Index c[3];
    for (int a = 0; a < 3; ++a) {
      const bool up = (k >> a) & 1;
      c[a] = std::clamp<Index>(base[a] + (up ? 1 : 0), 0, side_ - 1);
      w *= up ? f[a] : 1 - f[a];
    }
    const std::int32_t cell = numbers_[static_cast<std::size_t>(c[0] + side_ * (c[1] + side_ * c[2]))];
    if (cell < 0 || !(w > 0)) continue;
    total += w;
    const auto known = std::find(out.cell, out.cell + out.count, cell) - out.cell;
    if (known == out.count) {
      out.cell[out.count] = cell;
      out.weight[out.count++] = 0;
    }
    out.weight[known] += w;
  }
  for (int i = 0; i < out.count; ++i) out.weight[i] /= total;
  return out;
}

void CellGrid::blend(std::span<const std::int8_t> signs, const float* x, Index n, float* s) const {
  for (Index i = 0; i < n; ++i) {
    const Near cells = near(x + 3 * i);
    float sum = 0;
    for (int k = 0; k < cells.count; ++k)
      sum += cells.weight[k] * static_cast<float>(signs[static_cast<std::size_t>(cells.cell[k])]);
    s[i] = std::clamp(kSteepness * sum, -1.f, 1.f);
  }
}

CellGrid::Mix CellGrid::mix(const float* x) const {
  const Near cells = near(x);
  Mix out{.count = cells.count};
  std::copy_n(cells.cell, cells.count, out.cell.begin());
  for (int k = 0; k < cells.count; ++k)
    if (kSteepness * (2 * cells.weight[k] - 1) >= 1) {  // whatever the others' signs are
      out.part[static_cast<std::size_t>(k)] = 1;
      return out;
    }
  if (cells.count == 0) return out;
  // s[way]: the output of blend() where bit k - 1 of way is set if cell k's sign is -. The first cell's sign
  // is +, because reversing all signs gives the same products.
  std::array<float, 128> s{cells.weight[0]};
  std::size_t ways = 1;
  for (int k = 1; k < cells.count; ++k, ways *= 2)
    for (std::size_t i = 0; i < ways; ++i) {
      s[ways + i] = s[i] - cells.weight[k];
      s[i] += cells.weight[k];
    }
  for (std::size_t i = 0; i < ways; ++i)
    s[i] = std::clamp(kSteepness * s[i], -1.f, 1.f) / static_cast<float>(ways);
  // A cell's part is the sum over its + less the sum over its -; then both merge for the cells before it.
  for (auto k = static_cast<std::size_t>(cells.count) - 1; k > 0; --k) {
    ways /= 2;
    for (std::size_t i = 0; i < ways; ++i) {
      out.part[k] += s[i] - s[ways + i];
      s[i] += s[ways + i];
    }
  }
  out.part[0] = s[0];
  return out;
}

}  // namespace fieldmark::watermark
