#include <fieldmark/core/error.h>

#include <nlohmann/json.hpp>

#include "support/catch.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using namespace fieldmark::watermark;

namespace {
std::shared_ptr<const Mark> stored(const std::string& configuration, const CellGrid& cells) {
  ParamStore<float> params;
  const nerf::RadianceField field = small_field();
  return stored_mark(configuration)({params, field, cells, 3, 9});
}
}  // namespace

TEST_CASE("mark: a stored configuration makes the same kind of mark again") {
  for (const Owner& owner : {small_owner(), small_paper_owner()}) {
    const std::string configuration = owner.mark().configuration();
    const auto again = stored(configuration, owner.cells);
    CHECK(again->preset() == owner.mark().preset());
    CHECK(again->configuration() == configuration);
  }
}

TEST_CASE("mark: other presets and ablations of version 0.1 are refused") {
  const auto with = [](const Owner& owner, const char* key, const nlohmann::json& value) {
    auto j = nlohmann::json::parse(owner.mark().configuration());
    j[key] = value;
    return stored(j.dump(), owner.cells);
  };
  CHECK_THROWS_WITH(with(small_owner(), "preset", "slow"),
                    "[owner] preset must be fast, paper or code, got slow");
  CHECK_THROWS_WITH(with(small_owner(), "keyed_signs", false),
                    "[owner] keyed_signs must be true, got an ablation of version 0.1");
  CHECK_THROWS_WITH(with(small_paper_owner(), "budget", true),
                    "[owner] budget must be false, got an ablation of version 0.1");
  CHECK_THROWS_WITH(with(small_paper_owner(), "fusion", nlohmann::json::array({"bare_colour"})),
                    Contains("[owner] fusion must be that of its preset"));
}

TEST_CASE("mark: cells are dealt under the key given") {
  const Owner owner = small_owner();
  const CellCode want = deal_cells(test_key(2), owner.cells.area(), 3),
                 got = owner.mark().code(owner.cells, test_key(2), 3);
  CHECK(got.bit == want.bit);
  CHECK(got.sign == want.sign);
}
