#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <string>

#include "cli/command_line.h"
#include "cli/context.h"
#include "cli/long_run.h"

namespace fieldmark::cli {

/// Of the attacks that train a field.
struct TrainingAttackOptions {
  std::string data;       ///< photographs, for finetune
  std::string owner;      ///< whose extractor is known, for remove
  double mark_psnr = 34;  ///< of what remove changes in an image, dB on the object
  Index size = 0;         ///< of photographs and renders, longer side; 0: as they are, as in training
  Index views = 100;
  double lr = 5e-3;
  RunLength length;
};
void add_training_attack(CommandLine& app, TrainingAttackOptions& options);

/// "finetune", "finetune-renders", "remove" and "retrain".
bool is_training_attack(const std::string& name);

/// finetune goes on training the field on photographs, finetune-renders on its own images, remove on
/// images of it turned against the extractor; retrain trains a new field of the same sizes, with other
/// initial numbers, on its images. @param result  gets "steps", "seconds" and "psnr_trained"
nerf::RadianceField run_training_attack(const std::string& name, const nerf::RadianceField& field,
                                        const TrainingAttackOptions& options, Context& context, Json& result);

}  // namespace fieldmark::cli
