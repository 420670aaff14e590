#include <fieldmark/core/error.h>
#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>

#include <algorithm>
#include <cmath>

#include "support/catch.h"
#include "support/random.h"
#include "support/temporary_folder.h"
#include "watermark/marked_colours.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

TEST_CASE("fusion_mark: preset paper marks by its network of position, direction, colour and message") {
  const TemporaryFolder folder;
  const Owner owner = small_paper_owner();
  CHECK_FALSE(owner.mark().has_cells());
  CHECK_FALSE(owner.mark().has_gain());
  CHECK(owner.code().carriers() == 3);
  owner.save(folder / "a");
  const Owner again = Owner::load(folder / "a");
  CHECK(again.mark().preset() == "paper");
  again.save(folder / "b");
  CHECK(read_bytes(folder / "a") == read_bytes(folder / "b"));
  const Tensor<float> x = uniform<float>({1100, 3}, 0, 1, 1), rgb = uniform<float>({1100, 3}, 0, 1, 2);
  const auto signs = cell_signs(owner.code(), Message{{0, 1, 1}});
  const Tensor<float> message({1, 3}, std::vector<float>(signs.begin(), signs.end()));
  Tape<float> tape;
  const auto want =
      fusion_mark_of(owner).network()(Params<float>(owner.params, nullptr), tape.constant(x),
                                      tape.constant(x), tape.constant(rgb), tape.constant(message));
  CHECK(marked(again, signs, x, rgb.data) == std::vector<float>(want.value(), want.value() + 3300));
  CHECK(marked(again, cell_signs(owner.code(), Message{{1, 0, 0}}), x, rgb.data) !=
        marked(again, signs, x, rgb.data));
}

TEST_CASE("fusion_mark: preset code reads raw colours and density, and is kept with all its switches") {
  const TemporaryFolder folder;
  FusionMarkOptions o = code_options();
  CHECK(o.message_features == 128);
  o.width = 8;
  o.message_features = 5;
  o.channels = 4;
  const Owner owner(small_field(), small_owner_options(), test_key(1), message_slots(3), fusion_mark(o));
  owner.save(folder / "a");
  const Owner again = Owner::load(folder / "a");
  CHECK(again.mark().preset() == "code");
  CHECK(fusion_mark_of(again).network().options().message_features == 5);
  const Tensor<float> x = uniform<float>({20, 3}, 0, 1, 1), rgb = uniform<float>({20, 3}, 0, 1, 2);
  const auto raw = fusion_mark_of(owner).network_colours(owner.field, x.data.data(), rgb.data.data(), 20);
  REQUIRE(raw.size() == 80);
  Tape<float> tape;
  const auto said =
      owner.field.field(Params<float>(owner.field.params, nullptr), tape.constant(x), tape.constant(x));
  for (std::size_t i = 0; i < 20; ++i) {
    CHECK(1 / (1 + std::exp(-raw[4 * i + 1])) == Approx(rgb.data[3 * i + 1]).margin(2e-3));
    CHECK(std::exp(16 * raw[4 * i + 3]) == Approx(said.sigma.value()[i]).epsilon(1e-4));
  }
  CHECK(marked(again, {1, -1, 1}, x, rgb.data) == marked(owner, {1, -1, 1}, x, rgb.data));
  CHECK(marked(again, {1, -1, 1}, x, rgb.data) != marked(owner, {1, -1, -1}, x, rgb.data));
}

TEST_CASE("fusion_mark: slots are one for each bit, of equal area") {
  for (Index bits : {1, 8, 9, 16, 48, 256}) {
    const CellGrid slots = message_slots(bits);
    REQUIRE(slots.count() == bits);
    for (double a : slots.area()) CHECK(a == Approx(1.0 / static_cast<double>(bits)));
  }
  CHECK_THROWS_WITH(message_slots(0), "[message_slots] bits must be at least 1, got 0");
  CHECK_THROWS_WITH(Owner(small_field(), small_owner_options(), test_key(1), message_slots(4), fusion_mark()),
                    "[owner] cells must be message_slots(bits) for a mark without cells: 3, got 4");
}

TEST_CASE("fusion_mark: an image confirms its own reading more than inverted bits would") {
  const Owner owner = small_paper_owner();
  const auto image = uniform<float>({32, 32, 3}, 0, 1, 1);
  const auto logits = owner.mark().evidence(owner, image, nullptr);
  double want = 0;
  for (const double s : logits) want += std::log1p(std::exp(-std::abs(s))) / 3;
  Tape<float> tape;
  CHECK(owner.mark().confirmation(owner, image)(tape.constant(image)).value()[0] == Approx(want));
  CHECK_THROWS_WITH(
      owner.mark().carrier(Params<float>(owner.params, nullptr), tape.constant(image), tape.constant(image)),
      "[carriers] owner must have cells in space, got one of preset paper");
}
