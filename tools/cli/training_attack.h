#pragma once
#include <fieldmark/nerf/radiance_field.h>

#include <string>

#include "cli/command_line.h"
#include "cli/context.h"
#include "cli/long_run.h"

namespace fieldmark::cli {

/// Options of attacks that train a field.
struct TrainingAttackOptions {
  std::string data;       ///< folder of clean images, for finetune
  std::string owner;      ///< file with the known extractor, for remove
  std::string preset;     ///< kind of the new field of retrain, "hash" or "mlp"; empty: as attacked
  double mark_psnr = 34;  ///< of the modified renders of remove, dB on the foreground
  Index size = 0;         ///< longer side of the training images, pixels; 0: original size
  Index views = 100;
  double lr = 5e-3;
  RunLength length;
};
void add_training_attack(CommandLine& app, TrainingAttackOptions& options);

/// True for "finetune", "finetune-renders", "remove" and "retrain".
bool is_training_attack(const std::string& name);

/// Runs an attack. finetune continues the field's training on clean images, finetune-renders on its own
/// renders, and remove on renders modified against the extractor; retrain trains a new field, with another
/// initialisation, on renders of the old one. The new field has the old one's sizes, or if it is of another
/// kind, those of `train`.
/// @param result  receives "steps", "seconds" and "psnr_trained"
nerf::RadianceField run_training_attack(const std::string& name, const nerf::RadianceField& field,
                                        const TrainingAttackOptions& options, Context& context, Json& result);

}  // namespace fieldmark::cli
