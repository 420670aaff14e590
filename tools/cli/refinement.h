#pragma once
#include <fieldmark/nerf/refined_cameras.h>
#include <fieldmark/nerf/trainer.h>

#include <functional>
#include <optional>
#include <string>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// What a training learns of its images beside the field.
struct Refinement {
  std::string exposure = "off";  ///< off, on or auto
  bool poses = false;
};

/// Adds --exposure and --refine-poses.
void add_refinement(CommandLine& app, Refinement& refinement);
/// @throws UsageError if the preset cannot do what is asked for
void check_refinement(const Refinement& refinement, const std::string& preset);

/// Decides --exposure auto by two short trainings, which it prints.
/// @param held_out    validation images, or none: then exposures stay off
/// @param checkpoint  of the run that resumes, which decided before; empty: none
/// @param report      becomes what was tried, for the results   @throws Interrupted
bool wants_exposures(const Refinement& refinement, const nerf::Dataset& train,
                     const std::function<std::optional<nerf::Dataset>()>& held_out,
                     const nerf::RadianceFieldOptions& field, const std::string& checkpoint, Json& report,
                     Context& context);

/// The file beside a field that holds its training's refined cameras: FIELD.cameras.json.
std::string cameras_file(const std::string& field);
/// Writes the file. @return mean motion, for the results
Json save_cameras(const std::string& field, const nerf::Dataset& data,
                  const std::vector<nerf::Camera>& cameras, Context& context);

/// Moves the cameras of a data set to where a field shows its images.
/// @return mean motion, for the results   @throws UsageError for an mlp field   @throws Interrupted
Json fit_cameras(const nerf::RadianceField& field, nerf::Dataset& data, Context& context);

}  // namespace fieldmark::cli
