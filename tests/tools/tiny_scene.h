#pragma once
#include <fieldmark/nerf/trainer.h>

#include <string>

#include "nerf/small_field.h"
#include "support/catch.h"
#include "support/temporary_folder.h"
#include "tools/run_command.h"

/// Writes a built-in scene of a few small images below the folder; returns its path.
inline std::string tiny_scene(const TemporaryFolder& folder, const char* views = "16") {
  const std::string path = folder / "scene";
  const auto r = run_command({"scene", "--out", path, "--kind", "sphere", "--size", "16", "--views", views});
  REQUIRE(r.code == 0);
  return path;
}

/// Trains a small field with long steps along its rays on the scene for a moment; returns its path. `train`
/// makes larger fields, whose views take six times as long, and a command renders hundreds.
inline std::string tiny_field(const TemporaryFolder& folder, const std::string& scene) {
  using namespace fieldmark;
  const std::string path = folder / "field.fm";
  const nerf::Dataset data = nerf::load_dataset(scene);
  nerf::RadianceField field(trainable_field_options());
  nerf::Trainer trainer(field, data, {.schedule = {.steps = 100}, .samples_per_step = 8192, .warm_up = 16});
  while (!trainer.done()) trainer.step(0);
  field.save(path);
  return path;
}
