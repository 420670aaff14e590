#include <fieldmark/watermark/embedding/recipe.h>
#include <fieldmark/watermark/mark/flatness.h>

#include <algorithm>
#include <cmath>

namespace fieldmark::watermark {
namespace {

constexpr double kSpacing = 1.7320508 / 420;  // of samples by default, cube sides
constexpr double kFaintest = 40;              // mark PSNR by default, dB
constexpr Index kPaperPatch = 80;             // pixels
constexpr Index kPaperBatch = 8;              // images per step, whose statistics normalise the extractor

}  // namespace

const char* mark_colours_name(MarkColours colours) {
  switch (colours) {
    case MarkColours::light:
      return "light";
    case MarkColours::mixed:
      return "mixed";
    case MarkColours::blue:
      break;
  }
  return "blue";
}

MarkColours parse_mark_colours(std::string_view name) {
  for (const MarkColours c : {MarkColours::blue, MarkColours::light, MarkColours::mixed})
    if (name == mark_colours_name(c)) return c;
  throw ValueError("[mark_colours] expected blue, light or mixed, got '" + std::string(name) + "'");
}

MarkColours colours_for(nerf::SpaceKind space) {
  return space == nerf::SpaceKind::cube ? MarkColours::mixed : MarkColours::light;
}

void use_colours(MarkColours colours, CellMarkOptions& mark) {
  const CellMarkOptions usual;
  const bool light = colours == MarkColours::light;
  mark.network.bands =
      light ? 5 : usual.network.bands;  // detail finer than a cell costs likeness without a benefit
  mark.network.tilt = colours == MarkColours::blue ? usual.network.tilt : 50;
  mark.network.shading = light ? 0.97 : usual.network.shading;
  mark.training.smooth_weight = light ? 0 : usual.training.smooth_weight;  // light is smooth
  mark.training.flat_weight = light ? 0.8 : usual.training.flat_weight;    // and most visible on walls
}

double mark_psnr_for(std::span<const CachedView> views, nerf::SpaceKind space) {
  const double usual = OwnerOptions{}.mark_psnr;
  if (space != nerf::SpaceKind::cube) return usual;
  const double suited = usual - 10 * std::log10(1 - flat_share(views));
  return std::min(std::round(10 * suited) / 10, kFaintest);
}

Index batch_for(nerf::SpaceKind space) {
  return space == nerf::SpaceKind::contracted ? 2 : EmbedOptions{}.batch;
}

EmbedRecipe embed_recipe(std::string_view preset) {
  EmbedRecipe r;
  if (preset == "fast") return r;
  r.owner.reader_size = kPaperPatch;
  r.views.all_directions = false;  // novel cameras, as in the paper
  r.embed.schedule = {.seconds = 2400, .lr = 1.5e-3, .half_after = 5000, .cooldown = 0.4, .last = 0.05};
  r.embed.batch = kPaperBatch;
  if (preset == "paper") {
    r.mark = paper_options();
    r.embed.distortions = {.noise = 0.02, .rotation = 30, .zoom_out = 0.75, .zoom_in = 1, .blur = 0.1};
  } else if (preset == "code") {
    r.mark = code_options();
    r.embed.extractor_lr = 2;
    // Here too, samples move in all directions, not along the ray about the lower end of their interval.
    r.embed.distortions = {
        .noise = 0, .rotation = 0, .zoom_out = 1, .zoom_in = 1, .blur = 0, .sample_shift = 0.2 * kSpacing};
  } else {
    throw ValueError("[embed_recipe] preset must be fast, paper or code, got " + std::string(preset));
  }
  return r;
}

CellMarkOptions& EmbedRecipe::cell() {
  if (const auto* fusion = std::get_if<FusionMarkOptions>(&mark))
    throw ValueError(std::string("preset ") + (fusion->authors_code ? "code" : "paper") +
                     " does not have this option");
  return std::get<CellMarkOptions>(mark);
}

FusionMarkOptions& EmbedRecipe::fusion() {
  if (auto* options = std::get_if<FusionMarkOptions>(&mark)) return *options;
  throw ValueError("preset fast does not have this option");
}

void EmbedRecipe::suit(const nerf::RadianceField& field) {
  auto* cells_of_scene = std::get_if<CellMarkOptions>(&mark);
  if (!cells_of_scene) return;
  owner.reader_aspect = reader_aspect(field);
  use_colours(colours_for(field.space.kind), *cells_of_scene);
  embed.batch = batch_for(field.space.kind);
}

void EmbedRecipe::suit_mark_psnr(const nerf::RadianceField& field, std::span<const CachedView> cached) {
  if (std::holds_alternative<CellMarkOptions>(mark))
    owner.mark_psnr = mark_psnr_for(cached, field.space.kind);
}

CellGrid EmbedRecipe::grid(const nerf::RadianceField& field, std::span<const CachedView> cached) const {
  if (!std::holds_alternative<CellMarkOptions>(mark)) return message_slots(owner.bits);
  const Index side = cells > 0 ? cells : cells_for_message(cached, owner.bits, field.space.kind);
  return {side, visible_area(cached, side)};
}

MarkMaker EmbedRecipe::maker() const {
  if (const auto* fusion = std::get_if<FusionMarkOptions>(&mark)) return fusion_mark(*fusion);
  return cell_mark(std::get<CellMarkOptions>(mark));
}

}  // namespace fieldmark::watermark
