#pragma once
#include <fieldmark/core/files.h>

#include <filesystem>
#include <string>

#include "support/catch.h"
#include "support/source_dir.h"

/// Checks that the engine's header NAME.h includes every header of the folder NAME.
inline void expect_headers_of_folder(const std::string& name) {
  const std::filesystem::path headers = source_dir() + "/engine/include/fieldmark/engine";
  const std::string all = fieldmark::read_text(headers / (name + ".h"));
  for (const auto& entry : std::filesystem::directory_iterator(headers / name))
    CHECK_THAT(all,
               Contains("#include <fieldmark/engine/" + name + "/" + entry.path().filename().string() + ">"));
}
