#pragma once
#include <fieldmark/engine/shape.h>

#include "cli/command_line.h"

namespace fieldmark::cli {

/// Adds --supersampling N, see RenderOptions::supersampling. @param rays  0 if it is not given
void add_supersampling(CommandLine& app, Index& rays);

}  // namespace fieldmark::cli
