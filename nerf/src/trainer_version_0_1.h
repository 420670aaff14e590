#pragma once
#include <fieldmark/engine/safetensors.h>

#include <string>

namespace fieldmark::nerf {

// Checkpoints of version 0.1 describe their run in one line, which begins with the field's configuration.
// Empty if the file is not such a checkpoint.
std::string configuration_of_version_0_1(const SafetensorsFile& file);

}  // namespace fieldmark::nerf
