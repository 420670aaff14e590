#pragma once
#include <fieldmark/engine/packed_weights.h>

#include <string>

#include "cli/command_line.h"

namespace fieldmark::cli {

/// --precision fp32|bf16, stored by name.
void add_precision(CommandLine& app, std::string& name);
/// @throws UsageError for bf16 where the CPU has no such products
Precision precision_of(const std::string& name);

}  // namespace fieldmark::cli
