#include <fieldmark/engine/ops.h>

#include <filesystem>
#include <string>

#include <fieldmark/core/files.h>

#include "support/catch.h"
#include "support/source_dir.h"

TEST_CASE("ops.h has every header of its folder") {
  const std::filesystem::path headers = source_dir() + "/engine/include/fieldmark/engine";
  const std::string all = fieldmark::read_text(headers / "ops.h");
  for (const auto& entry : std::filesystem::directory_iterator(headers / "ops"))
    CHECK_THAT(all, Contains("#include <fieldmark/engine/ops/" + entry.path().filename().string() + ">"));
}
