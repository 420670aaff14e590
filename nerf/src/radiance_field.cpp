#include <fieldmark/core/error.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/nerf/radiance_field.h>
#include "table_rows.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fieldmark::nerf {
namespace {

using Json = nlohmann::json;
constexpr const char *kOccupancy = "density/occupancy", *kRows = "hash/rows";

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// The interleaved table as two tensors: columns [begin, begin + F) of the rows that are kept.
std::vector<float> table_part(std::span<const float> table, std::size_t row, std::size_t begin,
                              const std::vector<std::uint8_t>& kept) {
  std::vector<float> part;
  for (std::size_t r = 0; r < kept.size(); ++r)
    if (kept[r])
      part.insert(part.end(), table.begin() + static_cast<std::ptrdiff_t>(r * row + begin),
                  table.begin() + static_cast<std::ptrdiff_t>(r * row + begin + row / 2));
  return part;
}

void set_table_part(std::span<float> table, std::size_t row, std::size_t begin,
                    const std::vector<std::uint8_t>& kept, const std::vector<float>& part) {
  for (std::size_t r = 0, k = 0; r < kept.size(); ++r)
    for (std::size_t f = 0; f < row / 2; ++f) table[r * row + begin + f] = kept[r] ? part[k++] : 0;
}

std::vector<std::uint8_t> to_bits(Index n, const auto& is_set) {
  std::vector<std::uint8_t> packed(at((n + 7) / 8));
  for (Index i = 0; i < n; ++i)
    if (is_set(i)) packed[at(i / 8)] = static_cast<std::uint8_t>(packed[at(i / 8)] | (1u << (i % 8)));
  return packed;
}

std::vector<std::uint8_t> read_bits(const SafetensorsFile& file, const std::string& name, Index n) {
  const std::vector<std::uint8_t> packed = file.u8(name);
  if (static_cast<Index>(packed.size()) != (n + 7) / 8)
    throw IoError(file.path + ": tensor '" + name + "': expected " + std::to_string((n + 7) / 8) +
                  " bytes, found " + std::to_string(packed.size()));
  std::vector<std::uint8_t> bits(at(n));
  for (std::size_t i = 0; i < bits.size(); ++i) bits[i] = (packed[i / 8] >> (i % 8)) & 1;
  return bits;
}

Tensor<float> read_tensor(const SafetensorsFile& file, const std::string& name, const Shape& shape) {
  Tensor<float> t = file.f32(name);
  if (t.shape != shape)
    throw IoError(file.path + ": tensor '" + name + "': expected shape " + shape.str() +
                  " from the file's configuration, found " + t.shape.str());
  return t;
}

void add_space(Json& json, const Space& s) {
  json["space"] = name_of(s.kind);
  if (s.kind == SpaceKind::ndc) {
    json["slopes"] = {s.slope_x, s.slope_y};
  } else {
    json["corner"] = s.bounds.corner;
    json["side"] = s.bounds.side;
  }
  if (s.kind != SpaceKind::cube) json["near"] = s.near;
}

Space parse_space(const Json& j) {
  Space s{.kind = parse_space_kind(j.value("space", "cube"))};
  const auto positive = [&](const Json& number, const char* name, bool zero = false) {
    const double value = number;
    if (!(zero ? value >= 0 : value > 0) || !std::isfinite(value))
      throw ValueError(std::string(name) + " must be positive and finite, got " + std::to_string(value));
    return value;
  };
  if (s.kind == SpaceKind::ndc) {
    s.near = positive(j.at("near"), "near");
    s.slope_x = positive(j.at("slopes").at(0), "slopes");
    s.slope_y = positive(j.at("slopes").at(1), "slopes");
    return s;
  }
  s.bounds.corner = j.at("corner");
  s.bounds.side = positive(j.at("side"), "side");
  if (s.kind == SpaceKind::contracted) s.near = positive(j.at("near"), "near", true);
  return s;
}

struct TablePart {
  const char* name;
  std::size_t begin;
};

std::array<TablePart, 2> table_parts(const FieldOptions& o) {
  return {TablePart{"hash/density_features", 0}, TablePart{"hash/colour_features", at(o.encoding.features)}};
}

// What tells kinds apart is the entry "kind"; a hash field, the first there was, has none.
Json field_json(const RadianceFieldOptions& o) {
  const FieldOptions& f = o.field;
  if (f.kind == FieldKind::mlp)
    return {{"kind", "mlp"},
            {"layers", f.mlp.layers},
            {"width", f.mlp.width},
            {"skip", f.mlp.skip},
            {"position_bands", f.mlp.position_bands},
            {"direction_bands", f.mlp.direction_bands},
            {"average_points", o.points.average},
            {"importance_points", o.points.importance},
            {"random_points", o.points.random}};
  return {{"levels", f.encoding.levels},
          {"features", f.encoding.features},
          {"log2_table", f.encoding.log2_table},
          {"base_resolution", f.encoding.base_resolution},
          {"finest_resolution", f.encoding.finest_resolution},
          {"width", f.width},
          {"geometry", f.geometry},
          {"directional", f.directional}};
}

void parse_field(const Json& j, RadianceFieldOptions& o) {
  const std::string kind = j.value("kind", "hash");
  if (kind == "hash") {
    o.field = {.encoding = {.levels = j.at("levels"),
                            .features = j.at("features"),
                            .log2_table = j.at("log2_table"),
                            .base_resolution = j.at("base_resolution"),
                            .finest_resolution = j.at("finest_resolution")},
               .width = j.at("width"),
               .geometry = j.at("geometry"),
               .directional = j.value("directional", true)};
  } else if (kind == "mlp") {
    o.field = {.kind = FieldKind::mlp,
               .mlp = {.layers = j.at("layers"),
                       .width = j.at("width"),
                       .skip = j.at("skip"),
                       .position_bands = j.at("position_bands"),
                       .direction_bands = j.at("direction_bands")}};
    o.points = {.average = j.at("average_points"),
                .importance = j.at("importance_points"),
                .random = j.at("random_points")};
  } else {
    throw ValueError("[radiance_field] kind must be hash or mlp, got " + kind);
  }
}

}  // namespace

RadianceField::RadianceField(const RadianceFieldOptions& options)
    : field(params, options.field, options.seed), grid(options.occupancy), options_(options) {
  if (options.field.kind == FieldKind::mlp)
    coarse.emplace(params, options.field, options.seed + 100, "coarse/");
  if (options.supersampling < 1 || options.supersampling > kMostSupersampling ||
      kMostSupersampling % options.supersampling != 0)
    throw ValueError("[radiance_field] supersampling must be 1, 2, 4 or 8, got " +
                     std::to_string(options.supersampling));
  if (!(options.step > 0 && options.step <= 1))
    throw ValueError("[radiance_field] step must be above 0 and at most 1, got " +
                     std::to_string(options.step));
}

std::string RadianceField::configuration() const {
  Json json = field_json(options_);
  json.update({{"occupancy", options_.occupancy},
               {"step", options_.step},
               {"background", background == Background::white ? "white" : "black"},
               {"cameras", Json::parse(format_camera_span(cameras))}});
  if (options_.supersampling > 1) json["supersampling"] = options_.supersampling;
  add_space(json, space);
  return json.dump();
}

RadianceField RadianceField::from_configuration(std::string_view text, std::string_view place) {
  try {
    const Json j = Json::parse(text);
    RadianceFieldOptions o;
    parse_field(j, o);
    o.occupancy = j.at("occupancy");
    o.step = j.at("step");
    o.supersampling = j.value("supersampling", Index{1});
    RadianceField field(o);
    field.space = parse_space(j);
    field.background = j.at("background") == "white" ? Background::white : Background::black;
    field.cameras = parse_camera_span(j.at("cameras").dump(), std::string(place) + ": cameras");
    return field;
  } catch (const Json::exception& e) {
    throw IoError(std::string(place) + ": expected a field's configuration, found " + e.what());
  } catch (const ValueError& e) {
    throw IoError(std::string(place) + ": expected a field's configuration within its ranges, found " +
                  e.what());
  }
}

void RadianceField::store(SafetensorsFile& file, const std::string& prefix) const {
  for (const auto& e : params.entries()) {
    if (e.name == "hash/table") continue;
    file.add(prefix + e.name, e.shape, params.values(params.find(e.name)));
  }
  if (field.has_table()) {
    const auto table = params.values(field.encoding().table());
    const auto row = at(2 * field.encoding().features());
    const std::vector<std::uint8_t> kept = rows_in_use(field.encoding(), grid);
    const Index count = std::count(kept.begin(), kept.end(), std::uint8_t{1}), rows = std::ssize(kept);
    for (const TablePart& part : table_parts(options_.field))
      file.add(prefix + part.name, {count, field.encoding().features()},
               table_part(table, row, part.begin, kept));
    if (count < rows)
      file.add(prefix + kRows, {(rows + 7) / 8}, to_bits(rows, [&](Index r) { return kept[at(r)] != 0; }));
  }
  file.add(prefix + kOccupancy, {grid.cells() / 8},
           to_bits(grid.cells(), [&](Index c) { return grid.occupied(c); }));
}

void RadianceField::restore(const SafetensorsFile& file, const std::string& prefix) {
  for (const auto& e : params.entries()) {
    if (e.name == "hash/table") continue;
    const Tensor<float> t = read_tensor(file, prefix + e.name, e.shape);
    std::copy(t.data.begin(), t.data.end(), params.values(params.find(e.name)).begin());
  }
  if (field.has_table()) {
    const auto row = at(2 * field.encoding().features());
    const Index rows = field.encoding().rows();
    const std::vector<std::uint8_t> kept = file.has(prefix + kRows) ? read_bits(file, prefix + kRows, rows)
                                                                    : std::vector<std::uint8_t>(at(rows), 1);
    const Shape shape{std::count(kept.begin(), kept.end(), std::uint8_t{1}), field.encoding().features()};
    for (const TablePart& part : table_parts(options_.field))
      set_table_part(params.values(field.encoding().table()), row, part.begin, kept,
                     read_tensor(file, prefix + part.name, shape).data);
  }
  grid.set_bits(read_bits(file, prefix + kOccupancy, grid.cells()));
}

void RadianceField::save(const std::filesystem::path& path) const {
  SafetensorsFile file;
  set_model_info(file, {.kind = "field", .config = configuration()});
  store(file, "");
  file.write(path);
}

RadianceField RadianceField::load(const std::filesystem::path& path) {
  const SafetensorsFile file = SafetensorsFile::read(path);
  const ModelInfo info = require_kind(file, "field");
  RadianceField field = from_configuration(info.config, path.string() + ": metadata 'fieldmark': config");
  field.restore(file, "");
  return field;
}

}  // namespace fieldmark::nerf
