#include <fieldmark/core/error.h>
#include <fieldmark/watermark/embedding/recipe.h>
#include <fieldmark/watermark/mark/flatness.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "watermark/tiny_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("recipe: names of colours there and back, others are refused") {
  for (const MarkColours c : {MarkColours::blue, MarkColours::light, MarkColours::mixed})
    CHECK(parse_mark_colours(mark_colours_name(c)) == c);
  CHECK_THROWS_AS(parse_mark_colours("grey"), ValueError);
  CHECK_THROWS_WITH(parse_mark_colours("grey"), "[mark_colours] expected blue, light or mixed, got 'grey'");
}

TEST_CASE("recipe: what suits a scene") {
  CHECK(colours_for(nerf::SpaceKind::cube) == MarkColours::mixed);
  CHECK(colours_for(nerf::SpaceKind::contracted) == MarkColours::light);
  CHECK(colours_for(nerf::SpaceKind::ndc) == MarkColours::light);
  CHECK(batch_for(nerf::SpaceKind::cube) == EmbedOptions{}.batch);
  CHECK(batch_for(nerf::SpaceKind::ndc) == EmbedOptions{}.batch);
  CHECK(batch_for(nerf::SpaceKind::contracted) == 2);
}

TEST_CASE("recipe: an object's flat share gets no power of its own, within a limit") {
  using enum nerf::SpaceKind;
  const double usual = OwnerOptions{}.mark_psnr, flat = flat_share(tiny_views());
  REQUIRE((flat > 0.01 && flat < 0.5));
  CHECK(mark_psnr_for(tiny_views(), cube) == Approx(usual - 10 * std::log10(1 - flat)).margin(0.0501));
  CHECK(mark_psnr_for(tiny_views(), ndc) == usual);
  CHECK(mark_psnr_for(tiny_views(), contracted) == usual);
  CHECK(mark_psnr_for({}, cube) == usual);
  auto plain = tiny_views();
  for (auto& view : plain) std::ranges::fill(view.base.data, 0.5f);
  CHECK(mark_psnr_for(plain, cube) == 40);
  auto half = std::vector{plain[0], plain[0]};  // half of what is seen is flat: +3.01 dB
  for (Index p = 0; p < half[1].base.size() / 3; ++p) half[1].base[3 * p + 1] = static_cast<float>(p % 2);
  CHECK(mark_psnr_for(half, cube) == Approx(39.5).epsilon(1e-12));
}

TEST_CASE("recipe: preset fast suits its mark PSNR to the views, presets of the paper keep theirs") {
  const nerf::RadianceField field = tiny_field();
  EmbedRecipe fast = embed_recipe("fast");
  CHECK(fast.views.all_directions == std::nullopt);
  fast.suit_mark_psnr(field, tiny_views());
  CHECK(fast.owner.mark_psnr == mark_psnr_for(tiny_views(), field.space.kind));
  CHECK(fast.owner.mark_psnr > OwnerOptions{}.mark_psnr);
  for (const char* preset : {"paper", "code"}) {
    EmbedRecipe other = embed_recipe(preset);
    other.suit_mark_psnr(field, tiny_views());
    CHECK(other.owner.mark_psnr == OwnerOptions{}.mark_psnr);
    CHECK(other.views.all_directions == false);  // as in the paper
  }
}

TEST_CASE("recipe: blue is the default, light is smooth, tilted and shaded") {
  const CellMarkOptions usual;
  CellMarkOptions mark;
  use_colours(MarkColours::light, mark);
  CHECK(mark.network.bands < usual.network.bands);
  CHECK((mark.network.tilt > 0 && mark.network.tilt < 90));
  CHECK((mark.network.shading > 0 && mark.network.shading <= 1));
  CHECK(mark.training.smooth_weight == 0);
  CHECK(mark.training.flat_weight > usual.training.flat_weight);
  use_colours(MarkColours::mixed, mark);
  CHECK(mark.network.tilt == 50);
  CHECK(mark.network.bands == usual.network.bands);
  CHECK(mark.network.shading == 0);
  use_colours(MarkColours::blue, mark);
  CHECK(mark.network.bands == usual.network.bands);
  CHECK(mark.network.tilt == 0);
  CHECK(mark.network.shading == 0);
  CHECK(mark.training.smooth_weight == usual.training.smooth_weight);
  CHECK(mark.training.flat_weight == usual.training.flat_weight);
}

TEST_CASE("recipe: each preset makes its kind of mark, and refuses the options of another") {
  for (const std::string preset : kPresets) {
    CAPTURE(preset);
    EmbedRecipe recipe = embed_recipe(preset);
    recipe.suit(tiny_field());
    recipe.owner.bits = 4;
    const Owner owner = recipe.make(tiny_field(), test_key(1), tiny_views());
    CHECK(owner.mark().preset() == preset);
    CHECK(owner.mark().has_cells() == (preset == "fast"));
    CHECK(owner.mark().has_gain() == (preset == "fast"));
    CHECK(owner.options().reader_size == (preset == "fast" ? 160 : 80));
    if (preset == "fast") {
      CHECK(owner.cells.side() == cells_for_message(tiny_views(), 4, tiny_field().space.kind));
      CHECK_THROWS_WITH(recipe.fusion(), "preset fast does not have this option");
    } else {
      CHECK_THROWS_WITH(recipe.cell(), "preset " + preset + " does not have this option");
    }
  }
  CHECK_THROWS_WITH(embed_recipe("slow"), "[embed_recipe] preset must be fast, paper or code, got slow");
  EmbedRecipe recipe = embed_recipe("fast");
  recipe.cells = 6;
  CHECK(recipe.grid(tiny_field(), tiny_views()).side() == 6);
}

TEST_CASE("recipe: presets paper and code train as the paper and its authors' code") {
  const EmbedRecipe paper = embed_recipe("paper"), code = embed_recipe("code");
  CHECK(paper.embed.extractor_lr == 1);
  CHECK(paper.embed.batch == 8);
  CHECK(paper.embed.schedule.seconds == 2400);
  CHECK(embed_recipe("fast").embed.schedule.seconds == 300);
  CHECK(paper.embed.distortions.rotation == 30);
  CHECK(paper.embed.distortions.zoom_in == 1);
  const auto& networks = std::get<FusionMarkOptions>(paper.mark);
  CHECK(networks.message_features == 256);
  CHECK(networks.running_norm);
  CHECK(networks.training.warm_steps > 0);
  CHECK(networks.training.matrix_rate == 2);
  CHECK(code.embed.extractor_lr == 2);
  CHECK(code.embed.distortions.noise == 0);
  CHECK(code.embed.distortions.sample_shift == Approx(8.248e-4).epsilon(1e-3));
  CHECK(std::get<FusionMarkOptions>(code.mark).message_features == 128);
  CHECK_FALSE(std::get<FusionMarkOptions>(code.mark).running_norm);
}
