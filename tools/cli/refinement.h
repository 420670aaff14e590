#pragma once
#include <fieldmark/nerf/refined_cameras.h>
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <optional>
#include <string>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// What training optimises per image besides the field.
struct Refinement {
  std::string exposure = "off";  ///< off, on or auto
  bool poses = false;
};

/// Adds --exposure and --refine-poses.
void add_refinement(CommandLine& app, Refinement& refinement);
/// @throws UsageError if the preset does not support the options
void check_refinement(const Refinement& refinement, const std::string& preset);

/// Decides --exposure auto with two short trainings, and prints their results.
/// @param held_out    validation images; empty: exposures stay off
/// @param checkpoint  of a resumed run, which has already decided; empty: none
/// @param report      receives the trials, for the results   @throws Interrupted
bool wants_exposures(const Refinement& refinement, const nerf::Dataset& train,
                     const std::function<std::optional<nerf::Dataset>()>& held_out,
                     const nerf::RadianceFieldOptions& field, const std::string& checkpoint, Json& report,
                     Context& context);

/// Returns the file next to a field that holds the refined cameras of its training: FIELD.cameras.json.
std::string cameras_file(const std::string& field);
/// Writes the file. @return mean motion, for the results
Json save_cameras(const std::string& field, const nerf::Dataset& data,
                  const std::vector<nerf::Camera>& cameras, Context& context);

/// Aligns the cameras of a data set with a field, so that its renders match the images.
/// @return mean motion, for the results   @throws UsageError for an mlp field   @throws Interrupted
Json fit_cameras(const nerf::RadianceField& field, nerf::Dataset& data, Context& context);

}  // namespace fieldmark::cli
