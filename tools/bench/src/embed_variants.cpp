#include <fieldmark/tools/bench/embed_variants.h>

#include <cmath>
#include <utility>

namespace fieldmark::bench {
namespace {

using watermark::EmbedDistances;
using watermark::MarkColours;

// Rows of different scenes are comparable: all have kCells per axis and the usual mark PSNR.
constexpr Index kCells = 16;

EmbedVariant base_variant(const char* preset, const ScheduleOptions& length, Index bits, std::uint64_t seed) {
  EmbedVariant v{.choice = "default", .setting = "as embed does", .recipe = watermark::embed_recipe(preset)};
  v.recipe.owner.bits = bits;
  v.recipe.owner.seed = v.recipe.embed.seed = seed;
  v.recipe.embed.schedule.steps = length.steps;
  v.recipe.embed.schedule.seconds = length.seconds;
  v.recipe.cells = kCells;
  return v;
}

class Variants {
 public:
  explicit Variants(const EmbedVariant& base) : base_(base), all_{base} {}
  // Adds the default with one change.
  template <class F>
  void vary(const char* choice, const std::string& setting, F change) {
    EmbedVariant v = base_;
    change(v);
    add(choice, setting, std::move(v));
  }
  void add(const char* choice, const std::string& setting, EmbedVariant v) {
    v.choice = choice;
    v.setting = setting;
    all_.push_back(std::move(v));
  }
  std::vector<EmbedVariant> take() { return std::move(all_); }

 private:
  EmbedVariant base_;
  std::vector<EmbedVariant> all_;
};

void lengths(Variants& all) {
  for (const auto& [name, factor] :
       {std::pair{"a quarter", 0.25}, std::pair{"half", 0.5}, std::pair{"twice", 2.0}})
    all.vary("length", name, [f = factor](EmbedVariant& v) {
      ScheduleOptions& s = v.recipe.embed.schedule;
      s.seconds *= f;
      s.steps = std::lround(f * static_cast<double>(s.steps));
    });
  all.vary("seed", "the next one: what chance does", [](EmbedVariant& v) {
    ++v.recipe.owner.seed;
    ++v.recipe.embed.seed;
  });
}

// The extractor's input.
void views(Variants& all) {
  for (const Index side : {128, 200, 256})
    all.vary("patch", std::to_string(side) + " pixels",
             [=](EmbedVariant& v) { v.recipe.owner.reader_size = side; });
  for (const Index kept : {2, 4})
    all.vary("samples", std::to_string(kept) + " kept of a ray",
             [=](EmbedVariant& v) { v.recipe.views.samples = kept; });
  for (const Index count : {50, 800})
    all.vary("views", std::to_string(count), [=](EmbedVariant& v) { v.recipe.views.count = count; });
  all.vary("directions", "only novel cameras",
           [](EmbedVariant& v) { v.recipe.views.all_directions = false; });
  all.vary("distances", "native, at the resolution of images",
           [](EmbedVariant& v) { v.recipe.views.distances = EmbedDistances::native; });
  all.vary("distances", "half of the views closer or farther",
           [](EmbedVariant& v) { v.recipe.views.distances = EmbedDistances::several; });
  all.vary("distortions", "none", [](EmbedVariant& v) {
    v.recipe.embed.distortions = {
        .noise = 0, .rotation = 0, .zoom_out = 1, .zoom_in = 1, .blur = 0, .sample_shift = 0};
  });
  all.vary("distortions", "one kind a batch, not mixed",
           [](EmbedVariant& v) { v.recipe.embed.distortions.mixed = false; });
}

// The carrier of the message, and its mark PSNR.
void marks(Variants& all, MarkColours colours) {
  for (const Index side : {8, 12, 20, 24, 32})
    all.vary("cells", std::to_string(side) + " an axis", [=](EmbedVariant& v) { v.recipe.cells = side; });
  for (const int mark_psnr : {33, 40})
    all.vary("mark_psnr", std::to_string(mark_psnr) + " dB",
             [=](EmbedVariant& v) { v.recipe.owner.mark_psnr = mark_psnr; });
  all.vary("budget", "the mark PSNR from the first step on",
           [](EmbedVariant& v) { v.recipe.cell().training.first_mark_psnr = v.recipe.owner.mark_psnr; });
  all.vary("budget", "annealed from 24 dB",
           [](EmbedVariant& v) { v.recipe.cell().training.first_mark_psnr = 24; });
  for (const int steps : {50, 800})
    all.vary("budget", "annealed over " + std::to_string(steps) + " steps",
             [=](EmbedVariant& v) { v.recipe.cell().training.anneal = steps; });
  all.vary("hiding", "off", [](EmbedVariant& v) {
    auto& training = v.recipe.cell().training;
    training.smooth_weight = training.flat_weight = training.peak_weight = 0;
  });
  for (const MarkColours other : {MarkColours::blue, MarkColours::light, MarkColours::mixed})
    if (other != colours)
      all.vary("colours", watermark::mark_colours_name(other),
               [=](EmbedVariant& v) { watermark::use_colours(other, v.recipe.cell()); });
}

// The training options.
void training(Variants& all) {
  all.vary("supervision", "pooled bits alone", [](EmbedVariant& v) {
    v.recipe.cell().training.sign_weight = v.recipe.cell().training.index_weight = 0;
  });
  all.vary("supervision", "places alone", [](EmbedVariant& v) { v.recipe.cell().training.bits_weight = 0; });
  all.vary("supervision", "cells weigh twice",
           [](EmbedVariant& v) { v.recipe.cell().training.index_weight *= 2; });
  for (const Index batch : {2, 8})
    all.vary("batch", std::to_string(batch) + " images",
             [=](EmbedVariant& v) { v.recipe.embed.batch = batch; });
  for (const Index channels : {16, 48})
    all.vary("extractor", std::to_string(channels) + " channels",
             [=](EmbedVariant& v) { v.recipe.cell().base_channels = channels; });
  all.vary("optimiser", "Adam for all weights",
           [](EmbedVariant& v) { v.recipe.cell().training.matrix_rate = 0; });
  for (const int rate : {1, 6})
    all.vary("optimiser", "Muon with " + std::to_string(rate) + " times Adam's step size",
             [=](EmbedVariant& v) { v.recipe.cell().training.matrix_rate = rate; });
  all.vary("learning rate", "half", [](EmbedVariant& v) { v.recipe.embed.schedule.lr /= 2; });
  all.vary("learning rate", "twice", [](EmbedVariant& v) { v.recipe.embed.schedule.lr *= 2; });
  all.vary("learning rate", "falls over the last quarter",
           [](EmbedVariant& v) { v.recipe.embed.schedule.cooldown = 0.25; });
}

}  // namespace

std::vector<EmbedVariant> embed_variants(const ScheduleOptions& length, Index bits, std::uint64_t seed,
                                         MarkColours colours) {
  EmbedVariant usual = base_variant("fast", length, bits, seed);
  watermark::use_colours(colours, usual.recipe.cell());
  Variants all(usual);
  lengths(all);
  for (const char* preset : {"paper", "code"})
    all.add("preset", preset, base_variant(preset, length, bits, seed));
  views(all);
  marks(all, colours);
  training(all);
  return all.take();
}

}  // namespace fieldmark::bench
