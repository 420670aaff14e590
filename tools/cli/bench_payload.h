#pragma once
#include <fieldmark/engine/shape.h>

#include "cli/command_line.h"

namespace fieldmark::cli {

class Context;

/// Of `bench payload`.
struct BenchPayloadOptions {
  Index bits = 100, trials = 1000;
};
/// Adds --bits and --trials.
void add_bench_payload(CommandLine& app, BenchPayloadOptions& options);

/// How often payloads are exact at rates of wrong bits, and how often noise is one.
int bench_payload(const BenchPayloadOptions& options, Context& context);

}  // namespace fieldmark::cli
