#include "cli/owner_note.h"

#include <sstream>

#include "support/catch.h"
#include "support/source_dir.h"
#include "watermark/small_owner.h"

using namespace fieldmark;
using watermark::Owner;

TEST_CASE("owner_note: an owner of version 0.1 comes with a line on its bound, others with none") {
  const auto noted = [](const Owner& owner) {
    std::ostringstream out, err;
    cli::Context context({}, {}, out, err);
    cli::note_unproven_bound(owner, context);
    return out.str();
  };
  const Owner old =
      Owner::load(std::filesystem::path(source_dir()) / "tests/regression/version_0_1/owner.fm");
  CHECK_THAT(noted(old), Contains("note: the networks") && Contains("not proven"));
  CHECK(noted(small_owner()).empty());
}
