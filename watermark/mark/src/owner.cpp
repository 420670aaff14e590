#include <fieldmark/core/number_text.h>
#include <fieldmark/engine/model_file.h>
#include <fieldmark/watermark/mark/owner.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;

constexpr double kLeastAspect = 0.25;
constexpr double kPatchStep = 8;  // pixels: the extractor halves its images repeatedly

OwnerOptions checked(const OwnerOptions& o) {
  if (o.bits < 1 || o.bits > 256)
    throw ValueError("[owner] bits must be 1 to 256, got " + std::to_string(o.bits));
  if (!(o.mark_psnr >= 20 && o.mark_psnr <= 60))
    throw ValueError("[owner] mark_psnr must be 20 to 60 dB, got " + number_text(o.mark_psnr));
  if (o.reader_size < 32)
    throw ValueError("[owner] reader_size must be at least 32 pixels, got " + std::to_string(o.reader_size));
  if (!(o.reader_aspect >= kLeastAspect && o.reader_aspect <= 1 / kLeastAspect))
    throw ValueError("[owner] reader_aspect must be 0.25 to 4, got " + number_text(o.reader_aspect));
  return o;
}

std::string configuration(const Owner& owner) {
  const OwnerOptions& o = owner.options();
  Json j{{"bits", o.bits},
         {"strength", o.mark_psnr},
         {"cells", owner.cells.side()},
         {"reader_size", o.reader_size},
         {"reader_aspect", o.reader_aspect},
         {"seed", o.seed},
         {"gain", owner.gain},
         {"key_free", owner.key_free()},
         {"field", Json::parse(owner.field.configuration())},
         // Ablation switches of version 0.1.
         {"colours", true},
         {"budget", false},
         {"keyed_signs", true}};
  if (!owner.key) j["has_key"] = false;
  j.update(Json::parse(owner.mark().configuration()));
  return j.dump();
}

OwnerOptions parse_options(const Json& j) {
  OwnerOptions o;
  o.bits = j.at("bits");
  o.mark_psnr = j.at("strength");
  o.reader_size = j.at("reader_size");
  o.reader_aspect = j.value("reader_aspect", o.reader_aspect);  // missing in older owners
  o.seed = j.at("seed");
  return o;
}

constexpr const char *kArea = "cells/area", *kStrength = "cells/strength";
// A program that deals all cells by area would read other bits: it finds no kArea and says so.
constexpr const char* kAreaBesideStrength = "cells/area_beside_strength";

CellGrid stored_cells(const SafetensorsFile& file, Index side) {
  const bool dealt_by_area = !file.has(kStrength);
  CellGrid cells = CellGrid::from_numbers(side, file.i32("cells/numbers"),
                                          file.f64(dealt_by_area ? kArea : kAreaBesideStrength).data);
  if (dealt_by_area) return cells;
  const std::string head = file.path + ": tensor '" + kStrength + "': ";
  const Shape& shape = file.at(kStrength).shape;
  if (shape.rank() != 2 || shape[0] < 1 || shape[1] != cells.count())
    throw IoError(head + "expected shape [views, " + std::to_string(cells.count()) + "], found " +
                  shape.str());
  try {
    cells.set_strength(file.i32(kStrength));
  } catch (const ValueError& e) {
    throw IoError(head + e.what());
  }
  return cells;
}

}  // namespace

PatchSize OwnerOptions::patch() const {
  if (reader_aspect == 1) return square_patch(reader_size);
  const double shorter = static_cast<double>(reader_size) * std::min(reader_aspect, 1 / reader_aspect);
  const auto side = static_cast<Index>(kPatchStep * std::max(std::round(shorter / kPatchStep), 2.0));
  return reader_aspect > 1 ? PatchSize{side, reader_size} : PatchSize{reader_size, side};
}

double reader_aspect(const nerf::RadianceField& field) {
  const nerf::CameraSpan& images = field.cameras;
  if (field.space.kind == nerf::SpaceKind::cube || images.height < 1 || images.width < 1) return 1;
  return std::clamp(static_cast<double>(images.width) / static_cast<double>(images.height), kLeastAspect,
                    1 / kLeastAspect);
}

Owner::Owner(nerf::RadianceField base, const OwnerOptions& options, const std::optional<Key>& owner_key,
             CellGrid grid, const MarkMaker& make)
    : field(std::move(base)),
      key(owner_key),
      cells(std::move(grid)),
      options_(checked(options)),
      mark_(make({params, field, cells, options.bits, options.seed})) {}

const Key& Owner::own_key() const {
  if (!key) throw ValueError("[owner] the owner holds no key (embed --no-key); give one");
  return *key;
}

void Owner::set_code(const Key& other, Index bits) {
  const bool any_length = mark_->has_cells();
  if (bits < 1 || bits > most_bits() || (!any_length && bits != options_.bits))
    throw ValueError("[owner] bits must be " +
                     (any_length ? "1 to " + std::to_string(most_bits()) + ", one for each cell"
                                 : std::to_string(options_.bits) + " with preset " + mark_->preset()) +
                     ", got " + std::to_string(bits));
  key = other;
  options_.bits = bits;
}

// The mark's amplitude is proportional to its gain while colours are not clamped at 0 and 1.
void Owner::set_mark_psnr(double mark_psnr) {
  if (!mark_->has_gain())
    throw ValueError("[owner] mark_psnr: preset " + mark_->preset() +
                     " has none to set, its networks decide it");
  OwnerOptions changed = options_;
  changed.mark_psnr = mark_psnr;
  checked(changed);
  gain *= std::pow(10.0, (options_.mark_psnr - mark_psnr) / 20);
  options_ = changed;
}

void Owner::save(const std::filesystem::path& path) const {
  SafetensorsFile file;
  set_model_info(file, {"owner", configuration(*this)});
  field.store(file, "field/");
  for (const auto& e : params.entries()) file.add(e.name, e.shape, params.values(params.find(e.name)));
  file.add("cells/numbers", {static_cast<Index>(cells.numbers().size())}, cells.numbers());
  const bool dealt_by_area = cells.strength().empty();
  file.add(dealt_by_area ? kArea : kAreaBesideStrength, {cells.count()}, cells.area());
  if (!dealt_by_area)
    file.add(kStrength, {std::ssize(cells.strength()) / cells.count(), cells.count()}, cells.strength());
  if (key) file.add("key", {32}, std::span<const std::uint8_t>(key->bytes));
  file.write(path, Access::secret);
}

Owner Owner::load(const std::filesystem::path& path) {
  const SafetensorsFile file = SafetensorsFile::read(path);
  const ModelInfo info = require_kind(file, "owner");
  const std::string place = path.string() + ": metadata 'fieldmark': config";
  try {
    const Json j = Json::parse(info.config);
    const OwnerOptions options = parse_options(j);
    nerf::RadianceField field =
        nerf::RadianceField::from_configuration(j.at("field").dump(), place + ": field");
    field.restore(file, "field/");
    std::optional<Key> key;
    if (j.value("has_key", true)) key = key_from_bytes(file.u8("key"));
    Owner owner(std::move(field), options, key, stored_cells(file, j.at("cells")), stored_mark(info.config));
    owner.gain = j.at("gain");
    owner.key_free_ = j.value("key_free", false);
    for (const auto& e : owner.params.entries()) {
      const Tensor<float> t = file.f32(e.name);
      if (t.shape != e.shape)
        throw IoError(path.string() + ": tensor '" + e.name + "': expected shape " + e.shape.str() +
                      " from the file's configuration, found " + t.shape.str());
      std::copy(t.data.begin(), t.data.end(), owner.params.values(owner.params.find(e.name)).begin());
    }
    return owner;
  } catch (const Json::exception& e) {
    throw IoError(place + ": expected an owner's configuration, found " + e.what());
  } catch (const ValueError& e) {
    throw IoError(place + ": expected an owner's configuration within its ranges, found " + e.what());
  }
}

}  // namespace fieldmark::watermark
