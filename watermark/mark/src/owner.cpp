#include <fieldmark/engine/model_file.h>
#include <fieldmark/watermark/mark/owner.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace fieldmark::watermark {
namespace {

using Json = nlohmann::json;

constexpr std::array<const char*, 3> kPresets{"fast", "paper", "code"};
constexpr double kLeastAspect = 0.25;
constexpr double kPatchStep = 8;  // pixels: the extractor halves its images again and again

OwnerOptions checked(const OwnerOptions& o) {
  if (o.bits < 1 || o.bits > 256)
    throw ValueError("[owner] bits must be 1 to 256, got " + std::to_string(o.bits));
  if (!(o.mark_psnr >= 20 && o.mark_psnr <= 60))
    throw ValueError("[owner] strength must be 20 to 60 dB, got " + std::to_string(o.mark_psnr));
  if (o.reader_size < 32)
    throw ValueError("[owner] reader_size must be at least 32 pixels, got " + std::to_string(o.reader_size));
  if (!(o.reader_aspect >= kLeastAspect && o.reader_aspect <= 1 / kLeastAspect))
    throw ValueError("[owner] reader_aspect must be 0.25 to 4, got " + std::to_string(o.reader_aspect));
  return o;
}

constexpr std::pair<const char*, bool MarkFusion::*> kFusion[] = {
    {"bare_message", &MarkFusion::bare_message},
    {"bare_colour", &MarkFusion::bare_colour},
    {"late_direction", &MarkFusion::late_direction},
    {"raw_colour", &MarkFusion::raw_colour},
    {"repeated", &MarkFusion::repeated}};

Json fusion_names(const MarkFusion& fusion) {
  Json names = Json::array();
  for (const auto& [name, part] : kFusion)
    if (fusion.*part) names.push_back(name);
  return names;
}

std::string configuration(const OwnerOptions& o, double gain, const nerf::RadianceField& field) {
  return Json{{"preset", preset_name(o.preset)},
              {"width", o.width},
              {"message_features", o.message_features},
              {"fusion", fusion_names(o.fusion)},
              {"channels", o.channels},
              {"colours", o.colours},
              {"budget", o.budget},
              {"keyed_signs", o.keyed_signs},
              {"bits", o.bits},
              {"strength", o.mark_psnr},
              {"cells", o.cells},
              {"reader_size", o.reader_size},
              {"reader_aspect", o.reader_aspect},
              {"bands", o.mark.bands},
              {"features", o.mark.features},
              {"tilt", o.mark.tilt},
              {"shading", o.mark.shading},
              {"red_green", o.mark.red_green},
              {"luminance", o.mark.luminance},
              {"base_channels", o.base_channels},
              {"seed", o.seed},
              {"gain", gain},
              {"field", Json::parse(field.configuration())}}
      .dump();
}

OwnerOptions parse_options(const Json& j) {
  OwnerOptions o;
  // Older owners do not have what is optional here.
  o.preset = parse_preset(j.value("preset", preset_name(o.preset)));
  o.width = j.value("width", o.width);
  o.channels = j.value("channels", o.channels);
  o.message_features = j.value("message_features", o.message_features);
  for (const auto& name : j.value("fusion", Json::array()))
    for (const auto& [known, part] : kFusion)
      if (name == known) o.fusion.*part = true;
  o.colours = j.value("colours", o.colours);
  o.budget = j.value("budget", o.budget);
  o.keyed_signs = j.value("keyed_signs", o.keyed_signs);
  o.bits = j.at("bits");
  o.mark_psnr = j.at("strength");
  o.cells = j.at("cells");
  o.reader_size = j.at("reader_size");
  o.reader_aspect = j.value("reader_aspect", o.reader_aspect);
  o.mark = {.bands = j.at("bands"),
            .features = j.at("features"),
            .tilt = j.value("tilt", 0.0),
            .shading = j.value("shading", 0.0),
            .red_green = j.at("red_green"),
            .luminance = j.at("luminance")};
  o.base_channels = j.at("base_channels");
  o.seed = j.at("seed");
  return o;
}

// Samples that a network takes at a time, so that what lies between its layers stays in cache.
constexpr Index kBlock = 1024;

// A Recolour of colour(tape, x, d, n, rgb), called for block after block of the samples.
template <class F>
nerf::Renderer::Recolour in_blocks(F colour) {
  return [colour = std::move(colour)](const float* x, const float* d, Index n, float* rgb) {
    Tape<float> tape;
    for (Index begin = 0; begin < n; begin += kBlock) {
      tape.reset();
      colour(tape, x + 3 * begin, d + 3 * begin, std::min(kBlock, n - begin), rgb + 3 * begin);
    }
  };
}

}  // namespace

const char* preset_name(Preset preset) { return kPresets[static_cast<std::size_t>(preset)]; }

Preset parse_preset(std::string_view name) {
  const auto found = std::find(kPresets.begin(), kPresets.end(), name);
  if (found == kPresets.end())
    throw ValueError("[owner] preset must be fast, paper or code, got " + std::string(name));
  return static_cast<Preset>(found - kPresets.begin());
}

OwnerOptions owner_options(Preset preset) {
  OwnerOptions o{.preset = preset};
  if (preset != Preset::code) return o;
  o.message_features = 128;
  o.fusion = {.late_direction = true, .raw_colour = true, .repeated = true};
  return o;
}

PatchSize OwnerOptions::patch() const {
  if (reader_aspect == 1) return square_patch(reader_size);
  const double shorter = static_cast<double>(reader_size) * std::min(reader_aspect, 1 / reader_aspect);
  const auto side = static_cast<Index>(kPatchStep * std::max(std::round(shorter / kPatchStep), 2.0));
  return reader_aspect > 1 ? PatchSize{side, reader_size} : PatchSize{reader_size, side};
}

double reader_aspect(const nerf::RadianceField& field) {
  const nerf::CameraSpan& photographs = field.cameras;
  if (field.space.kind == nerf::SpaceKind::cube || photographs.height < 1 || photographs.width < 1) return 1;
  return std::clamp(static_cast<double>(photographs.width) / static_cast<double>(photographs.height),
                    kLeastAspect, 1 / kLeastAspect);
}

CellGrid message_slots(Index bits) {
  if (bits < 1) throw ValueError("[message_slots] bits must be at least 1, got " + std::to_string(bits));
  Index side = 2;
  while (side * side * side < bits) ++side;
  std::vector<double> area(static_cast<std::size_t>(side * side * side));
  std::fill_n(area.begin(), bits, 1.0);
  return CellGrid(side, area);
}

Owner::Owner(nerf::RadianceField base, const OwnerOptions& options, const Key& owner_key, CellGrid grid)
    : field(std::move(base)), key(owner_key), cells(std::move(grid)), options_(checked(options)) {
  options_.cells = cells.side();
  if (options.preset == Preset::fast) {
    mark.emplace(params, "mark", options.mark, options.seed + 100);
    reader.emplace(
        params, "extractor",
        extractor::DenseExtractorOptions{.classes = cells.count() + 1, .base = options.base_channels},
        options.seed + 200);
    return;
  }
  if (cells.count() != options.bits)
    throw ValueError(std::string("[owner] cells must be message_slots(bits) for preset ") +
                     preset_name(options.preset) + ": " + std::to_string(options.bits) + ", got " +
                     std::to_string(cells.count()));
  if (options.colours)
    global_mark.emplace(
        params, "mark",
        GlobalMarkOptions{
            .bits = options.bits,
            .message_features = options.message_features > 0 ? options.message_features : options.width,
            .colour_features = options.width,
            .width = options.width,
            .fusion = options.fusion},
        options.seed + 100);
  pooled_reader.emplace(
      params, "extractor",
      extractor::PooledExtractorOptions{.n_bits = options.bits, .channels = options.channels},
      options.seed + 200);
}

CellCode Owner::code(const Key& other) const {
  CellCode code = deal_cells(other, cells.area(), options_.bits);
  if (!options_.keyed_signs)
    for (std::int8_t& sign : code.sign) sign = static_cast<std::int8_t>(std::abs(sign));
  return code;
}

std::vector<float> Owner::fusion_colours(const float* x, const float* rgb, Index n) const {
  if (!options_.fusion.raw_colour) return {rgb, rgb + 3 * n};
  const nerf::Field<float>& net = field.field;
  const auto size = [&](Index columns) { return static_cast<std::size_t>(n * columns); };
  std::vector<float> density(size(net.density_width())), colour(size(net.colour_width()));
  net.encode(field.params, x, n, density.data(), colour.data());
  Tape<float> tape;
  const Var<float> z = net.geometry(Params<float>(field.params, nullptr),
                                    tape.constant(density.data(), {n, net.density_width()}));
  std::vector<float> raw(size(4));
  for (Index i = 0; i < n; ++i) {
    for (Index a = 0; a < 3; ++a) {
      const float c = std::clamp(rgb[3 * i + a], 1e-3f, 1 - 1e-3f);
      raw[static_cast<std::size_t>(4 * i + a)] = std::log(c / (1 - c));
    }
    raw[static_cast<std::size_t>(4 * i + 3)] = z.value()[i * net.geometry_width()] / 16;
  }
  return raw;
}

nerf::Renderer::Recolour Owner::marking(std::vector<std::int8_t> signs) const {
  if (!mark && !global_mark)
    throw ValueError("[owner] marking: expected an owner that marks colours, got one without");
  if (global_mark) {
    std::vector<float> message(signs.begin(), signs.end());
    return in_blocks([this, message = std::move(message)](Tape<float>& tape, const float* x, const float* d,
                                                          Index n, float* rgb) {
      const std::vector<float> base = fusion_colours(x, rgb, n);
      const Var<float> colour =
          (*global_mark)(Params<float>(params, nullptr), tape.constant(x, {n, 3}), tape.constant(d, {n, 3}),
                         tape.constant(base.data(), {n, global_mark->colour_inputs()}),
                         tape.constant(message.data(), {1, std::ssize(message)}));
      const float* c = colour.value();
      for (Index i = 0; i < 3 * n; ++i)
        rgb[i] = options_.budget ? std::clamp(rgb[i] + static_cast<float>(gain) * (c[i] - rgb[i]), 0.f, 1.f)
                                 : c[i];
    });
  }
  return in_blocks([this, signs = std::move(signs)](Tape<float>& tape, const float* x, const float*, Index n,
                                                    float* rgb) {
    std::vector<float> s(static_cast<std::size_t>(n));
    cells.blend(signs, x, n, s.data());
    const Var<float> carrier =
        mark->carrier(Params<float>(params, nullptr), tape.constant(x, {n, 3}), tape.constant(rgb, {n, 3}));
    for (Index i = 0; i < 3 * n; ++i)
      rgb[i] = std::clamp(
          rgb[i] + static_cast<float>(gain) * s[static_cast<std::size_t>(i / 3)] * carrier.value()[i], 0.f,
          1.f);
  });
}

// The mark's amplitude is in proportion to its gain while colours are not cut off at 0 and 1.
void Owner::set_mark_psnr(double mark_psnr) {
  if (!mark && !options_.budget)
    throw ValueError(std::string("[owner] strength is the networks' own in preset ") +
                     preset_name(options_.preset));
  if (!(mark_psnr >= 20 && mark_psnr <= 60))
    throw ValueError("[owner] strength must be in 20 to 60, got " + std::to_string(mark_psnr));
  gain *= std::pow(10.0, (options_.mark_psnr - mark_psnr) / 20);
  options_.mark_psnr = mark_psnr;
}

void Owner::save(const std::filesystem::path& path) const {
  SafetensorsFile file;
  set_model_info(file, {"owner", configuration(options_, gain, field)});
  field.store(file, "field/");
  for (const auto& e : params.entries()) file.add(e.name, e.shape, params.values(params.find(e.name)));
  file.add("cells/numbers", {static_cast<Index>(cells.numbers().size())}, cells.numbers());
  file.add("cells/area", {cells.count()}, cells.area());
  file.add("key", {32}, std::span<const std::uint8_t>(key.bytes));
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
    Owner owner(
        std::move(field), options, key_from_bytes(file.u8("key")),
        CellGrid::from_numbers(options.cells, file.i32("cells/numbers"), file.f64("cells/area").data));
    owner.gain = j.at("gain");
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
