#include <fieldmark/engine/nn.h>

#include <filesystem>
#include <string>

#include <fieldmark/core/files.h>

#include "support/catch.h"
#include "support/source_dir.h"

TEST_CASE("nn.h has every header of its folder") {
  const std::filesystem::path headers = source_dir() + "/engine/include/fieldmark/engine";
  const std::string all = fieldmark::read_text(headers / "nn.h");
  for (const auto& entry : std::filesystem::directory_iterator(headers / "nn"))
    CHECK_THAT(all, Contains("#include <fieldmark/engine/nn/" + entry.path().filename().string() + ">"));
}
