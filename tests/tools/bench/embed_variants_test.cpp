#include <fieldmark/tools/bench/embed_variants.h>

#include <map>
#include <set>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
const watermark::CellMarkOptions& cell(const EmbedVariant& v) {
  return std::get<watermark::CellMarkOptions>(v.recipe.mark);
}

using Differs = bool (*)(const EmbedVariant&, const EmbedVariant&);
// The options that each choice may change.
const std::map<std::string, Differs> kChoices{
    {"length",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.recipe.embed.schedule.steps != b.recipe.embed.schedule.steps &&
              a.recipe.embed.schedule.seconds != b.recipe.embed.schedule.seconds;
     }},
    {"seed",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.recipe.embed.seed != b.recipe.embed.seed && a.recipe.owner.seed != b.recipe.owner.seed;
     }},
    {"directions",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.recipe.views.all_directions != b.recipe.views.all_directions;
     }},
    {"preset", [](const EmbedVariant& a,
                  const EmbedVariant& b) { return a.recipe.mark.index() != b.recipe.mark.index(); }},
    {"patch", [](const EmbedVariant& a,
                 const EmbedVariant& b) { return a.recipe.owner.reader_size != b.recipe.owner.reader_size; }},
    {"samples", [](const EmbedVariant& a,
                   const EmbedVariant& b) { return a.recipe.views.samples != b.recipe.views.samples; }},
    {"views", [](const EmbedVariant& a,
                 const EmbedVariant& b) { return a.recipe.views.count != b.recipe.views.count; }},
    {"distances", [](const EmbedVariant& a,
                     const EmbedVariant& b) { return a.recipe.views.distances != b.recipe.views.distances; }},
    {"distortions",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.recipe.embed.distortions.mixed != b.recipe.embed.distortions.mixed ||
              a.recipe.embed.distortions.noise != b.recipe.embed.distortions.noise;
     }},
    {"cells", [](const EmbedVariant& a, const EmbedVariant& b) { return a.recipe.cells != b.recipe.cells; }},
    {"mark_psnr", [](const EmbedVariant& a,
                     const EmbedVariant& b) { return a.recipe.owner.mark_psnr != b.recipe.owner.mark_psnr; }},
    {"budget",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return cell(a).training.first_mark_psnr != cell(b).training.first_mark_psnr ||
              cell(a).training.anneal != cell(b).training.anneal;
     }},
    {"hiding",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       const auto off = [](const EmbedVariant& v) {
         const auto& t = cell(v).training;
         return t.smooth_weight + t.flat_weight + t.peak_weight == 0;
       };
       return off(a) != off(b);
     }},
    {"colours",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return cell(a).network.luminance != cell(b).network.luminance ||
              cell(a).network.tilt != cell(b).network.tilt;
     }},
    {"supervision",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return cell(a).training.sign_weight != cell(b).training.sign_weight ||
              cell(a).training.index_weight != cell(b).training.index_weight ||
              cell(a).training.bits_weight != cell(b).training.bits_weight;
     }},
    {"batch", [](const EmbedVariant& a,
                 const EmbedVariant& b) { return a.recipe.embed.batch != b.recipe.embed.batch; }},
    {"extractor", [](const EmbedVariant& a,
                     const EmbedVariant& b) { return cell(a).base_channels != cell(b).base_channels; }},
    {"optimiser",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return cell(a).training.matrix_rate != cell(b).training.matrix_rate;
     }},
    {"learning rate", [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.recipe.embed.schedule.lr != b.recipe.embed.schedule.lr ||
              a.recipe.embed.schedule.cooldown != b.recipe.embed.schedule.cooldown;
     }}};
}  // namespace

TEST_CASE("embed_variants: every variant but the first differs from the default in its own choice") {
  const auto all = embed_variants({.steps = 40, .seconds = 60}, 48, 5);
  const EmbedVariant& usual = all.front();
  CHECK(usual.choice == "default");
  CHECK(usual.recipe.owner.bits == 48);
  CHECK(usual.recipe.cells == 16);
  CHECK(usual.recipe.views.count == watermark::EmbedViewOptions{}.count);
  std::set<std::string> names, choices;
  for (const EmbedVariant& v : all) {
    CAPTURE(v.choice, v.setting);
    CHECK(names.insert(v.choice + v.setting).second);
    CHECK(v.recipe.owner.bits == 48);
    CHECK(v.recipe.owner.seed == v.recipe.embed.seed);
    if (&v == &usual) continue;
    REQUIRE(kChoices.contains(v.choice));
    choices.insert(v.choice);
    // The paper's preset brings its own settings.
    for (const auto& [choice, differs] : kChoices)
      if (v.choice != "preset" || choice == "preset") CHECK(differs(v, usual) == (choice == v.choice));
  }
  CHECK(choices.size() == kChoices.size());
}

TEST_CASE("embed_variants: lengths are parts of the run's, and the paper's preset is the paper's") {
  for (const EmbedVariant& v : embed_variants({.steps = 40, .seconds = 60}, 8, 1)) {
    if (v.choice == "length" && v.setting == "a quarter") {
      CHECK(v.recipe.embed.schedule.steps == 10);
      CHECK(v.recipe.embed.schedule.seconds == 15);
    }
    if (v.choice == "preset") {
      const watermark::EmbedRecipe own = watermark::embed_recipe(v.setting);
      CHECK(v.recipe.owner.reader_size == own.owner.reader_size);
      CHECK(v.recipe.embed.schedule.lr == own.embed.schedule.lr);
      CHECK(v.recipe.embed.batch == own.embed.batch);
      CHECK(v.recipe.embed.schedule.steps == 40);
    }
  }
}
