#include <fieldmark/tools/bench/turns_bench.h>

#include <filesystem>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

int run_bench_turns(bench::TurnsOptions options, Context& context) {
  options.ours = std::filesystem::read_symlink("/proc/self/exe").string();
  const bench::Turns turns = with_progress(context, [&](const auto& progress) {
    return bench::take_turns(options, [&](double part) { progress("turns", part); });
  });
  const bench::TurnsRatio ratio = bench::ratio_of(turns);
  print_line(context, "ours over theirs: median %.3f, %.3f to %.3f in %ld pairs; %.3f by the fastest runs\n",
             ratio.median, ratio.low, ratio.high, static_cast<long>(options.runs), ratio.of_least);
  context.result({{"arguments", options.arguments},
                  {"against", options.theirs},
                  {"runs", options.runs},
                  {"ratio", ratio.median},
                  {"ratio_range", {ratio.low, ratio.high}},
                  {"ratio_of_fastest", ratio.of_least},
                  {"seconds", turns.ours},
                  {"seconds_against", turns.theirs}});
  return kOk;
}

}  // namespace

Command add_bench_turns(CommandLine& app) {
  auto o = std::make_shared<bench::TurnsOptions>();
  app.add_option("--against", o->theirs,
                 "Other fieldmark executable to run alternately with this one; a wrapper script must exec it")
      ->type_name("PROGRAM")
      ->required();
  add_number(app, "--runs", o->runs, 1, 1000, "Runs of each build, 1 to 1000");
  add_number(app, "--limit", o->limit_seconds, 0.1, 86400, "Time limit for each run in seconds, 0.1 to 86400",
             "S");
  app.add_option("command", o->arguments,
                 "Command to time with its options, after --; it must end with exit code 0. {} in it stands "
                 "for an empty folder of each run")
      ->type_name("-- COMMAND")
      ->default_str("")
      ->required();
  return [o](Context& context) { return run_bench_turns(*o, context); };
}

}  // namespace fieldmark::cli
