#include <fieldmark/baselines/departures.h>
#include <fieldmark/watermark/embedding/recipe.h>

#include <algorithm>
#include <set>

#include "support/catch.h"

using namespace fieldmark;
using namespace fieldmark::baselines;

TEST_CASE("departures: each part once, with the values that embed uses") {
  const auto rows = departures();
  std::set<std::string> parts;
  for (const Departure& row : rows) {
    CAPTURE(row.part);
    CHECK(parts.insert(row.part).second);
    for (const std::string* text : {&row.paper, &row.code, &row.preset_paper, &row.preset_code})
      CHECK(!text->empty());
  }
  const auto row = [&](const std::string& part) {
    const auto found = std::ranges::find(rows, part, &Departure::part);
    REQUIRE(found != rows.end());
    return *found;
  };
  const auto paper = watermark::embed_recipe("paper"), code = watermark::embed_recipe("code");
  CHECK(row("images a step").preset_paper == std::to_string(paper.embed.batch));
  CHECK(row("N_m").preset_code ==
        std::to_string(std::get<watermark::FusionMarkOptions>(code.mark).message_features));
  CHECK(row("N_m").paper == "256");
  CHECK(row("noise, standard deviation").preset_paper == "up to 0.02");
  CHECK(row("noise, standard deviation").preset_code == "none");
  CHECK(row("optimiser of H's convolutions").preset_paper == "Muon, 2 times Adam's step size");
  CHECK(row("warm start, steps").preset_paper == "1500 for up to 16 bits; for more, in proportion");
  CHECK(row("gamma_1, of the content loss").preset_paper ==
        "60, of the mean square; less for marks fainter than 25.5 dB");
  CHECK(row("beta_2 of Adam").preset_paper == "0.99");
  CHECK(row("step size").preset_code == "0.0015, of H 0.003");
}
