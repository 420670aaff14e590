#include <fieldmark/bench/field_variants.h>
#include <fieldmark/engine/error.h>
#include <fieldmark/engine/isa.h>
#include <fieldmark/engine/parallel.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::bench {
namespace {

constexpr Index kPlaces = 3;         // along each axis of a cell that is looked at
constexpr float kThreshold = 0.01f;  // as in training
constexpr Index kPiece = 64;         // coarse cells whose parts are looked at together

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::string fraction(Index n) { return "1/" + std::to_string(n) + " of the diagonal"; }

std::string number(const char* format, double value) {
  char text[40];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

// Densities at n places of the unit cube.
void densities(const nerf::RadianceField& field, const std::vector<float>& x, Tape<float>& tape,
               std::vector<float>& sigma) {
  const auto& encoding = field.field.encoding();
  const auto n = static_cast<Index>(x.size()) / 3;
  tape.reset();
  float *features = tape.scratch(n * encoding.width()), *unused = tape.scratch(n * encoding.width());
  encoding.encode(field.params.values(encoding.table()), x.data(), n, features, unused);
  const Var<float> z = field.field.geometry(Params<float>(field.params, nullptr),
                                            tape.constant(features, {n, encoding.width()}));
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

// Looks at the parts of every occupied cell.
std::vector<std::uint8_t> finer(const nerf::RadianceField& field, const nerf::OccupancyGrid& to) {
  const nerf::OccupancyGrid& grid = field.grid;
  const Index n = grid.resolution(), factor = to.resolution() / n, places = factor * kPlaces;
  std::vector<Index> cells;
  for (Index c = 0; c < grid.cells(); ++c)
    if (grid.occupied(c)) cells.push_back(c);
  std::vector<std::uint8_t> bits(at(to.cells()), 0);
  const auto side = 1 / static_cast<float>(n * places);
  parallel_for(static_cast<Index>(cells.size()), kPiece, [&](Index begin, Index end) {
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
  if (variant.step > 0) options.step = variant.step;
  if (variant.occupancy > 0) options.occupancy = variant.occupancy;
  nerf::RadianceField copy(options);
  std::copy(field.params.values().begin(), field.params.values().end(), copy.params.values().begin());
  if (variant.occupancy > 0)
    copy.grid = occupancy_at(field, variant.occupancy);
  else if (variant.skip_empty)
    copy.grid = field.grid;
  copy.bounds = field.bounds;
  copy.cameras = field.cameras;
  copy.background = field.background;
  return copy;
}

std::vector<FieldVariant> field_variants(const nerf::RadianceField& field, bool quick) {
  const nerf::RenderOptions usual;
  const float step = field.options().step;
  const Index n = std::lround(1 / step), cells = field.grid.resolution();
  std::vector<FieldVariant> all{{"default", fraction(n) + ", stop " + number("%g", usual.stop)}};
  const auto render = [&](const char* knob, const std::string& setting, auto change) {
    FieldVariant v{knob, setting, usual};
    change(v);
    all.push_back(v);
  };
  for (const double part : {0.25, 0.5, 0.7, 1.4, 2.0, 4.0}) {
    const Index samples = std::lround(static_cast<double>(n) * part);
    render("samples", fraction(samples), [&](auto& v) { v.step = 1 / static_cast<float>(samples); });
  }
  for (const float stop : {0.1f, 3e-2f, 1e-2f, 3e-3f, 3e-4f, 1e-4f, 0.f})
    render("stop", number("%g", stop), [&](auto& v) { v.render.stop = stop; });
  for (const float least : {1e-2f, 3e-3f, 1e-3f, 3e-4f, 1e-5f, 0.f})
    render("least weight", number("%g", least), [&](auto& v) { v.render.least_weight = least; });
  for (const Index resolution : {cells / 4, cells / 2, cells, 2 * cells})
    if (resolution >= 4 && resolution % 4 == 0 && resolution <= 512)
      render("occupancy", std::to_string(resolution) + (resolution == cells ? ", looked at anew" : ""),
             [&](auto& v) { v.occupancy = resolution; });
  render("occupancy", "none", [](auto& v) { v.skip_empty = false; });
  if (bf16_units() != Bf16Units::none)
    render("precision", "bf16", [](auto& v) { v.render.precision = Precision::bf16; });
  struct Order {
    const char* name;
    nerf::RayOrder order;
  };
  for (const Order& o :
       {Order{"lines of 256", {256, 1}}, Order{"tiles of 4 x 4", {4, 4}}, Order{"tiles of 8 x 8", {8, 8}},
        Order{"tiles of 32 x 32", {32, 32}}, Order{"tiles of 64 x 64", {64, 64}},
        Order{"Morton, 16 x 16", {16, 16, true}}, Order{"Morton, 32 x 32", {32, 32, true}}})
    render("ray order", o.name, [&](auto& v) { v.render.order = o.order; });
  const auto together = [&](double part, float stop, float least) {
    const Index samples = std::lround(static_cast<double>(n) * part);
    render("together", fraction(samples) + ", stop " + number("%g", stop) + ", least " + number("%g", least),
           [&](auto& v) {
             v.step = 1 / static_cast<float>(samples);
             v.render.stop = stop;
             v.render.least_weight = least;
           });
  };
  together(0.5, 3e-2f, 3e-3f);
  together(0.7, 1e-2f, 1e-3f);
  together(1, 1e-2f, 1e-3f);
  together(1, 3e-3f, 1e-3f);
  together(1.4, 3e-3f, 3e-4f);
  together(2, 1e-4f, 1e-5f);
  together(1, 0, 0);
  if (!quick) return all;
  std::vector<FieldVariant> few;
  for (const FieldVariant& v : all)
    if (few.empty() || few.back().knob != v.knob) few.push_back(v);
  return few;
}

}  // namespace fieldmark::bench
