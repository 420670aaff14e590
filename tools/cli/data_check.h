#pragma once
#include <cstdint>
#include <string>

#include "cli/command_line.h"

namespace fieldmark::cli {

class Context;

/// The arguments of `fieldmark data check`.
struct DataCheckArguments {
  std::string folder, cameras;
  std::int64_t size = 0;
};

void add_data_check(CommandLine& app, DataCheckArguments& options);
/// Examines a data set, and prints its contents and anything odd about it.
int run_data_check(const DataCheckArguments& options, Context& context);

}  // namespace fieldmark::cli
