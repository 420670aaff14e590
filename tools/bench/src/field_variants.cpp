#include <fieldmark/core/error.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/parallel.h>
#include <fieldmark/tools/bench/field_variants.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace fieldmark::bench {
namespace {

constexpr Index kPlaces = 3;         // along each axis of an examined cell
constexpr float kThreshold = 0.01f;  // as in training
constexpr Index kCells = 64;         // coarse cells examined together

std::string number(float value) {
  char text[40];
  std::snprintf(text, sizeof text, "%g", static_cast<double>(value));
  return text;
}

// Computes the densities at n points of the unit cube.
void densities(const nerf::RadianceField& field, const std::vector<float>& x, Tape<float>& tape,
               std::vector<float>& sigma) {
  const nerf::Field<float>& net = field.field;
  const auto n = static_cast<Index>(x.size()) / 3;
  tape.reset();
  float *features = tape.scratch(n * net.density_width()), *unused = tape.scratch(n * net.colour_width());
  net.encode(field.params, x.data(), n, features, unused);
  const Var<float> z =
      net.geometry(Params<float>(field.params, nullptr), tape.constant(features, {n, net.density_width()}));
  const float* found = field.field.density(z).value();
  sigma.assign(found, found + n);
}

std::vector<std::uint8_t> coarser(const nerf::OccupancyGrid& grid, const nerf::OccupancyGrid& to) {
  const Index n = grid.resolution(), factor = n / to.resolution();
  std::vector<std::uint8_t> bits(at(to.cells()), 0);
  for (Index c = 0; c < grid.cells(); ++c)
    if (grid.occupied(c)) bits[at(to.cell(c % n / factor, c / n % n / factor, c / (n * n) / factor))] = 1;
  return bits;
}

// Examines the parts of every occupied cell.
std::vector<std::uint8_t> finer(const nerf::RadianceField& field, const nerf::OccupancyGrid& to) {
  const nerf::OccupancyGrid& grid = field.grid;
  const Index n = grid.resolution(), factor = to.resolution() / n, places = factor * kPlaces;
  std::vector<Index> cells;
  for (Index c = 0; c < grid.cells(); ++c)
    if (grid.occupied(c)) cells.push_back(c);
  std::vector<std::uint8_t> bits(at(to.cells()), 0);
  const auto side = 1 / static_cast<float>(n * places);
  parallel_for(static_cast<Index>(cells.size()), kCells, [&](Index begin, Index end) {
    Tape<float> tape;
    std::vector<float> x, sigma;
    for (Index i = begin; i < end; ++i) {
      const Index corner[3] = {cells[at(i)] % n * places, cells[at(i)] / n % n * places,
                               cells[at(i)] / (n * n) * places};
      x.clear();
      for (Index k = 0; k < places * places * places; ++k)
        for (const Index p :
             {corner[0] + k % places, corner[1] + k / places % places, corner[2] + k / (places * places)})
          x.push_back((static_cast<float>(p) + 0.5f) * side);
      densities(field, x, tape, sigma);
      for (Index k = 0; k < places * places * places; ++k)
        if (sigma[at(k)] * field.step() > kThreshold)
          bits[at(to.cell((corner[0] + k % places) / kPlaces, (corner[1] + k / places % places) / kPlaces,
                          (corner[2] + k / (places * places)) / kPlaces))] = 1;
    }
  });
  return bits;
}

struct Sweep {
  std::vector<FieldVariant> all;
  double trained;  // samples on a diagonal

  explicit Sweep(const nerf::RadianceField& field) : trained(1 / static_cast<double>(field.options().step)) {
    add("default", text(nerf::RenderOptions{}), [](auto&) {});
  }
  template <class F>
  void add(const char* knob, const std::string& setting, F change) {
    FieldVariant v{knob, setting};
    change(v);
    all.push_back(v);
  }
  std::string samples(float finer) const {
    return "1/" + std::to_string(std::lround(trained * static_cast<double>(finer))) + " of the diagonal";
  }
  std::string text(const nerf::RenderOptions& o) const {
    return samples(o.finer) + ", stop " + number(o.stop) + ", least " + number(o.least_weight);
  }

  // Varies each knob on its own. @param cells  of the field's grid, per axis
  void add_knobs(Index cells) {
    for (const float finer : {0.25f, 0.5f, 0.75f, 1.f, 1.2f, 1.5f, 2.f, 4.f})
      add("samples", samples(finer), [&](auto& v) { v.render.finer = finer; });
    for (const float stop : {0.1f, 3e-2f, 1e-2f, 1e-3f, 3e-4f, 1e-4f, 0.f})
      add("stop", number(stop), [&](auto& v) { v.render.stop = stop; });
    for (const float least : {1e-2f, 3e-3f, 3e-4f, 1e-4f, 1e-5f, 0.f})
      add("least weight", number(least), [&](auto& v) { v.render.least_weight = least; });
    for (const Index side : {cells / 4, cells / 2, cells, 2 * cells})
      if (side >= 4 && side % 4 == 0 && side <= 512)
        add("occupancy", std::to_string(side) + (side == cells ? ", looked at anew" : ""),
            [&](auto& v) { v.occupancy = side; });
    add("occupancy", "none", [](auto& v) { v.skip_empty = false; });
    if (bf16_units() != Bf16Units::none)
      add("precision", "bf16", [](auto& v) { v.render.precision = Precision::bf16; });
  }

  // Varies all knobs together, from quick to exact.
  void add_together() {
    for (const auto& [finer, stop, least] : {std::array{0.5f, 3e-2f, 3e-3f},
                                             {0.75f, 1e-2f, 1e-3f},
                                             {1.f, 1e-2f, 1e-3f},
                                             {1.f, 1e-3f, 1e-4f},
                                             {1.2f, 3e-3f, 3e-4f},
                                             {1.5f, 3e-3f, 3e-4f},
                                             {2.f, 1e-3f, 1e-4f},
                                             {4.f, 1e-4f, 1e-5f},
                                             {1.f, 0.f, 0.f}}) {
      const nerf::RenderOptions o{.finer = finer, .stop = stop, .least_weight = least};
      add("together", text(o), [&](auto& v) { v.render = o; });
    }
  }
};

}  // namespace

nerf::OccupancyGrid occupancy_at(const nerf::RadianceField& field, Index resolution) {
  nerf::OccupancyGrid to(resolution);
  const Index n = field.grid.resolution();
  if (n % resolution != 0 && resolution % n != 0)
    throw ValueError("[occupancy_at] resolution must divide " + std::to_string(n) +
                     " or be a multiple of it, got " + std::to_string(resolution));
  to.set_bits(resolution < n ? coarser(field.grid, to) : finer(field, to));
  return to;
}

nerf::RadianceField with_variant(const nerf::RadianceField& field, const FieldVariant& variant) {
  nerf::RadianceFieldOptions options = field.options();
  if (variant.occupancy > 0) options.occupancy = variant.occupancy;
  nerf::RadianceField copy(options);
  std::copy(field.params.values().begin(), field.params.values().end(), copy.params.values().begin());
  if (variant.occupancy > 0)
    copy.grid = occupancy_at(field, variant.occupancy);
  else if (variant.skip_empty)
    copy.grid = field.grid;
  copy.space = field.space;
  copy.cameras = field.cameras;
  copy.background = field.background;
  return copy;
}

std::vector<FieldVariant> field_variants(const nerf::RadianceField& field, bool quick) {
  Sweep sweep(field);
  sweep.add_knobs(field.grid.resolution());
  sweep.add_together();
  if (!quick) return sweep.all;
  std::vector<FieldVariant> few;
  for (const FieldVariant& v : sweep.all)
    if (few.empty() || few.back().knob != v.knob) few.push_back(v);
  return few;
}

}  // namespace fieldmark::bench
