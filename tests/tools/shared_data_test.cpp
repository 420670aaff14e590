#include "cli/shared_data.h"

#include <fstream>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/environment.h"

using namespace fieldmark;

TEST_CASE("shared_data: a path is that below FIELDMARK_DATA, or empty where there is nothing") {
  const TemporaryFolder folder;
  std::ofstream(folder / "weights") << "x";
  {
    const EnvironmentVariable data("FIELDMARK_DATA", folder.path.c_str());
    CHECK(cli::shared_data("weights") == folder.path / "weights");
    CHECK(cli::shared_data("").lexically_normal() == (folder.path / "").lexically_normal());
    CHECK(cli::shared_data("lego").empty());
  }
  const EnvironmentVariable none("FIELDMARK_DATA", nullptr);
  CHECK(cli::shared_data("weights").empty());
  const EnvironmentVariable blank("FIELDMARK_DATA", "");
  CHECK(cli::shared_data("weights").empty());
}
