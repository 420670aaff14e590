#pragma once
#include <fieldmark/engine/shape.h>

#include <string>
#include <vector>

#include "cli/command_line.h"
#include "cli/message_option.h"

namespace fieldmark::cli {

class Context;

/// Of `bench attacks`.
struct BenchAttacksOptions {
  std::string owner;
  MessageOption message;              ///< baked into the field
  std::string field;                  ///< baked
  std::string other;                  ///< baked with another message, for average
  std::string onto;                   ///< another field, for copy
  std::vector<std::string> attacked;  ///< files made from the baked field by other means
  std::string cameras = "novel", plot;
  Index count = 50, informed_count = 4, size = 0;
  bool quick = false;
};
/// Adds what the other benches do not have.
void add_bench_attacks(CommandLine& app, BenchAttacksOptions& options);

/// Severity curves: how a baked mark fares under attacks on its images and its file, and what they cost.
int bench_attacks(const BenchAttacksOptions& options, Context& context);

}  // namespace fieldmark::cli
