#pragma once
#include "cli/bench_field.h"

namespace fieldmark::cli {

/// Trains fields in many ways for --seconds each, and prints what each reached on the val split.
int bench_training(const BenchFieldOptions& options, Context& context);

}  // namespace fieldmark::cli
