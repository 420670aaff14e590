#include <fieldmark/core/files.h>
#include <fieldmark/engine/safetensors.h>

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
