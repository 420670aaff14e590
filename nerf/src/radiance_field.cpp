#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/nerf/radiance_field.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "checks.h"
#include "table_rows.h"

namespace fieldmark::nerf {
namespace {

using Json = nlohmann::json;
constexpr const char *kTable = "hash/table", *kRows = "hash/rows", *kOccupancy = "density/occupancy";

// One of the two tensors of the interleaved table: columns [begin, begin + F) of the kept rows.
struct TablePart {
  const char* name;
  std::size_t begin;
};
std::array<TablePart, 2> table_parts(const FieldOptions& o) {
  return {TablePart{"hash/density_features", 0}, TablePart{"hash/colour_features", at(o.encoding.features)}};
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
      throw ValueError(std::string(name) + " must be positive and finite, got " + number_text(value));
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

// Calls use(key, size) for each size of a field in its file, except the kind.
void each_size(RadianceFieldOptions& o, const auto& use) {
  FieldOptions& f = o.field;
  if (f.kind == FieldKind::mlp) {
    use("layers", f.mlp.layers), use("width", f.mlp.width), use("skip", f.mlp.skip);
    use("position_bands", f.mlp.position_bands), use("direction_bands", f.mlp.direction_bands);
    use("average_points", o.points.average), use("importance_points", o.points.importance);
    use("random_points", o.points.random);
  } else {
    HashEncodingOptions& e = f.encoding;
    use("levels", e.levels), use("features", e.features), use("log2_table", e.log2_table);
    use("base_resolution", e.base_resolution), use("finest_resolution", e.finest_resolution);
    use("width", f.width), use("geometry", f.geometry), use("directional", f.directional);
  }
  use("occupancy", o.occupancy), use("step", o.step);
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
    throw ValueError("[radiance_field] step must be above 0 and at most 1, got " + number_text(options.step));
}

std::string RadianceField::configuration() const {
  Json json{{"background", background == Background::white ? "white" : "black"},
            {"cameras", Json::parse(format_camera_span(cameras))}};
  RadianceFieldOptions o = options_;
  each_size(o, [&](const char* key, const auto& size) { json[key] = size; });
  if (o.field.kind == FieldKind::mlp) json["kind"] = "mlp";  // hash fields, the first kind, have no such key
  if (o.supersampling > 1) json["supersampling"] = o.supersampling;
  add_space(json, space);
  return json.dump();
}

RadianceField RadianceField::from_configuration(std::string_view text, std::string_view place) {
  try {
    Json j = Json::parse(text);
    RadianceFieldOptions o;
    const std::string kind = j.value("kind", "hash");
    if (kind != "hash" && kind != "mlp")
      throw ValueError("[radiance_field] kind must be hash or mlp, got " + kind);
    o.field.kind = kind == "mlp" ? FieldKind::mlp : FieldKind::hash;
    j.emplace("directional", true);  // may be missing in files before version 0.1
    each_size(o, [&](const char* key, auto& size) { j.at(key).get_to(size); });
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
  for (const auto& e : params.entries())
    if (e.name != kTable) file.add(prefix + e.name, e.shape, params.values(params.find(e.name)));
  if (field.has_table()) {
    const auto table = params.values(field.encoding().table());
    const Index features = field.encoding().features();
    const std::vector<std::uint8_t> kept = rows_in_use(field.encoding(), grid);
    const Index count = std::count(kept.begin(), kept.end(), std::uint8_t{1}), rows = std::ssize(kept);
    for (const TablePart& part : table_parts(options_.field)) {
      std::vector<float> numbers;
      for (std::size_t r = 0; r < kept.size(); ++r) {
        const auto from = table.begin() + static_cast<std::ptrdiff_t>(2 * at(features) * r + part.begin);
        if (kept[r]) numbers.insert(numbers.end(), from, from + features);
      }
      file.add(prefix + part.name, {count, features}, numbers);
    }
    if (count < rows)
      file.add(prefix + kRows, {(rows + 7) / 8}, to_bits(rows, [&](Index r) { return kept[at(r)] != 0; }));
  }
  file.add(prefix + kOccupancy, {grid.cells() / 8},
           to_bits(grid.cells(), [&](Index c) { return grid.occupied(c); }));
}

void RadianceField::restore(const SafetensorsFile& file, const std::string& prefix) {
  for (const auto& e : params.entries()) {
    if (e.name == kTable) continue;
    const Tensor<float> t = read_tensor(file, prefix + e.name, e.shape);
    std::copy(t.data.begin(), t.data.end(), params.values(params.find(e.name)).begin());
  }
  if (field.has_table()) {
    const std::span<float> table = params.values(field.encoding().table());
    const Index rows = field.encoding().rows(), features = field.encoding().features();
    const std::vector<std::uint8_t> kept = file.has(prefix + kRows) ? read_bits(file, prefix + kRows, rows)
                                                                    : std::vector<std::uint8_t>(at(rows), 1);
    const Shape shape{std::count(kept.begin(), kept.end(), std::uint8_t{1}), features};
    for (const TablePart& part : table_parts(options_.field)) {
      const Tensor<float> t = read_tensor(file, prefix + part.name, shape);
      for (Index r = 0, k = 0; r < rows; ++r)
        for (Index f = 0; f < features; ++f)
          table[at(2 * features * r + f) + part.begin] = kept[at(r)] ? t[k++] : 0;
    }
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
