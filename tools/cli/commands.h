#pragma once
#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace fieldmark::cli {

class Context;

/// A subcommand after its options were added: to be called once they are parsed; returns the exit code.
using Command = std::function<int(Context&)>;

Command add_distort(CLI::App& app);
Command add_attack_field(CLI::App& app);
Command add_bake(CLI::App& app);
Command add_bench(CLI::App& app);
Command add_check(CLI::App& app);
Command add_compare(CLI::App& app);
Command add_data(CLI::App& app);
Command add_embed(CLI::App& app);
Command add_eval(CLI::App& app);
Command add_extract(CLI::App& app);
Command add_gradcheck(CLI::App& app);
Command add_info(CLI::App& app);
Command add_key(CLI::App& app);
Command add_measure(CLI::App& app);
Command add_render(CLI::App& app);
Command add_reproduce(CLI::App& app);
Command add_scene(CLI::App& app);
Command add_train(CLI::App& app);
Command add_verify(CLI::App& app);

}  // namespace fieldmark::cli
