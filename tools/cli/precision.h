#pragma once
#include <fieldmark/engine/packed_weights.h>

#include <string>

#include "cli/command_line.h"

namespace fieldmark::cli {

/// Adds --precision fp32|bf16, stored by name.
void add_precision(CommandLine& app, std::string& name);
/// Parses a precision. @throws UsageError for bf16 if the CPU has no bf16 products
Precision precision_of(const std::string& name);

}  // namespace fieldmark::cli
