#pragma once
#include <string>

#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

/// A built-in scene of a few small images, below the folder; returns its path.
inline std::string tiny_scene(const TemporaryFolder& folder, const char* views = "16") {
  const std::string path = folder / "scene";
  const auto r = run_command({"scene", "--out", path, "--kind", "sphere", "--size", "16", "--views", views});
  REQUIRE(r.code == 0);
  return path;
}

/// A field of at most 1 MB trained on it for some steps; returns its path.
inline std::string tiny_field(const TemporaryFolder& folder, const std::string& scene,
                              const char* steps = "4") {
  const std::string path = folder / "field.fm";
  const auto r =
      run_command({"train", "--data", scene, "--out", path, "--steps", steps, "--max-megabytes", "1"});
  INFO(r.err);
  REQUIRE(r.code == 0);
  return path;
}
