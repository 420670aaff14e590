#include <fieldmark/tools/bench/embed_variants.h>

#include <map>
#include <set>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::bench;

namespace {
using Differs = bool (*)(const EmbedVariant&, const EmbedVariant&);
// What each choice may change.
const std::map<std::string, Differs> kChoices{
    {"length",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.embed.schedule.steps != b.embed.schedule.steps &&
              a.embed.schedule.seconds != b.embed.schedule.seconds;
     }},
    {"seed",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.embed.seed != b.embed.seed && a.owner.seed != b.owner.seed;
     }},
    {"preset", [](const EmbedVariant& a, const EmbedVariant& b) { return a.owner.preset != b.owner.preset; }},
    {"patch",
     [](const EmbedVariant& a, const EmbedVariant& b) { return a.owner.reader_size != b.owner.reader_size; }},
    {"samples",
     [](const EmbedVariant& a, const EmbedVariant& b) { return a.views.samples != b.views.samples; }},
    {"views", [](const EmbedVariant& a, const EmbedVariant& b) { return a.views.count != b.views.count; }},
    {"distances",
     [](const EmbedVariant& a, const EmbedVariant& b) { return a.views.distances != b.views.distances; }},
    {"distortions",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.embed.distortions.mixed != b.embed.distortions.mixed ||
              a.embed.distortions.noise != b.embed.distortions.noise;
     }},
    {"cells", [](const EmbedVariant& a, const EmbedVariant& b) { return a.owner.cells != b.owner.cells; }},
    {"mark_psnr",
     [](const EmbedVariant& a, const EmbedVariant& b) { return a.owner.mark_psnr != b.owner.mark_psnr; }},
    {"budget",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.embed.first_mark_psnr != b.embed.first_mark_psnr || a.embed.anneal != b.embed.anneal;
     }},
    {"hiding",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       const auto off = [](const EmbedVariant& v) {
         return v.embed.smooth_weight + v.embed.flat_weight == 0;
       };
       return off(a) != off(b);
     }},
    {"colours",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.owner.mark.luminance != b.owner.mark.luminance || a.owner.mark.tilt != b.owner.mark.tilt;
     }},
    {"supervision",
     [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.embed.sign_weight != b.embed.sign_weight || a.embed.index_weight != b.embed.index_weight ||
              a.embed.bits_weight != b.embed.bits_weight;
     }},
    {"batch", [](const EmbedVariant& a, const EmbedVariant& b) { return a.embed.batch != b.embed.batch; }},
    {"extractor", [](const EmbedVariant& a,
                     const EmbedVariant& b) { return a.owner.base_channels != b.owner.base_channels; }},
    {"learning rate", [](const EmbedVariant& a, const EmbedVariant& b) {
       return a.embed.schedule.lr != b.embed.schedule.lr ||
              a.embed.schedule.cooldown != b.embed.schedule.cooldown;
     }}};
}  // namespace

TEST_CASE("embed_variants: every variant but the first differs from the default in its own choice") {
  const auto all = embed_variants({.steps = 40, .seconds = 60}, 48, 5);
  const EmbedVariant& usual = all.front();
  CHECK(usual.choice == "default");
  CHECK(usual.owner.bits == 48);
  CHECK(usual.owner.cells == watermark::OwnerOptions{}.cells);
  CHECK(usual.views.count == watermark::EmbedOptions{}.views);
  std::set<std::string> names, choices;
  for (const EmbedVariant& v : all) {
    CAPTURE(v.choice, v.setting);
    CHECK(names.insert(v.choice + v.setting).second);
    CHECK(v.owner.bits == 48);
    CHECK(v.owner.seed == v.embed.seed);
    CHECK(v.embed.views == v.views.count);
    if (&v == &usual) continue;
    REQUIRE(kChoices.contains(v.choice));
    choices.insert(v.choice);
    // The paper's preset brings settings of its own.
    for (const auto& [choice, differs] : kChoices)
      if (v.choice != "preset" || choice == "preset") CHECK(differs(v, usual) == (choice == v.choice));
  }
  CHECK(choices.size() == kChoices.size());
}

TEST_CASE("embed_variants: lengths are parts of the run's, and the paper's preset is the paper's") {
  for (const EmbedVariant& v : embed_variants({.steps = 40, .seconds = 60}, 8, 1)) {
    if (v.choice == "length" && v.setting == "a quarter") {
      CHECK(v.embed.schedule.steps == 10);
      CHECK(v.embed.schedule.seconds == 15);
    }
    if (v.choice == "preset") {
      CHECK(v.owner.reader_size == 150);
      CHECK(v.embed.schedule.lr == 5e-4);
      CHECK(v.embed.schedule.steps == 40);
    }
  }
}
