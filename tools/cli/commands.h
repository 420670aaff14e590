#pragma once
#include <functional>
#include <string>
#include <vector>

#include "cli/command_line.h"

namespace fieldmark::cli {

class Context;

/// A subcommand whose options are registered. Call it after parsing; it returns the exit code.
using Command = std::function<int(Context&)>;

Command add_distort(CommandLine& app);
Command add_attack_field(CommandLine& app);
Command add_bake(CommandLine& app);
Command add_bench(CommandLine& app);
Command add_check(CommandLine& app);
Command add_compare(CommandLine& app);
Command add_data(CommandLine& app);
Command add_embed(CommandLine& app);
Command add_eval(CommandLine& app);
Command add_export(CommandLine& app);
Command add_extract(CommandLine& app);
Command add_gradcheck(CommandLine& app);
Command add_info(CommandLine& app);
Command add_key(CommandLine& app);
Command add_measure(CommandLine& app);
Command add_null(CommandLine& app);
Command add_render(CommandLine& app);
Command add_reproduce(CommandLine& app);
Command add_scene(CommandLine& app);
Command add_trace(CommandLine& app);
Command add_train(CommandLine& app);
Command add_verify(CommandLine& app);

}  // namespace fieldmark::cli
