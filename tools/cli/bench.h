#pragma once
#include <fieldmark/nerf/dataset.h>
#include <fieldmark/nerf/radiance_field.h>

#include <cstdio>
#include <memory>
#include <ostream>
#include <string>
#include <type_traits>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// @{
/// The subjects of `bench`, each with its own options.
Command add_bench_attacks(CommandLine& app);
Command add_bench_captures(CommandLine& app);
Command add_bench_collapse(CommandLine& app);
Command add_bench_data(CommandLine& app);
Command add_bench_embed(CommandLine& app);
Command add_bench_engine(CommandLine& app);
Command add_bench_field(CommandLine& app);
Command add_bench_payload(CommandLine& app);
Command add_bench_tracing(CommandLine& app);
Command add_bench_training(CommandLine& app);
Command add_bench_turns(CommandLine& app);
/// @}

/// @{
/// Options shared by several subjects.
template <class T>
Option add_number(CommandLine& app, const char* name, T& value, std::type_identity_t<T> low,
                  std::type_identity_t<T> high, const char* help, const char* type = "N") {
  return app.add_option(name, value, help)->range(low, high)->type_name(type);
}
Option add_file(CommandLine& app, const char* name, std::string& value, const char* help, const char* type);
void add_scene_option(CommandLine& app, std::string& scene);
void add_plot(CommandLine& app, std::string& plot);
/// @}

/// Returns a split of the data set in a folder. Without a folder, uses lego in FIELDMARK_DATA or else the
/// built-in scene, which `quick` makes small.
nerf::Dataset bench_split(const std::string& folder, const std::string& split, bool quick);

/// Trains a field on a data set for a given time, with progress. @throws Interrupted on Ctrl-C
std::unique_ptr<nerf::RadianceField> trained_field(const nerf::Dataset& data, double seconds,
                                                   Context& context);

/// Calls `run` with a callback (name, fraction done) that shows progress and ends the run on Ctrl-C.
template <class F>
auto with_progress(Context& context, const F& run) {
  const InterruptGuard guard;
  Progress progress = context.progress("bench");
  return run([&](const std::string& name, double part) {
    if (guard.interrupted()) throw Interrupted("nothing was written");
    progress.update(part, name);
  });
}

/// Prints a line in the format of printf.
template <class... T>
void print_line(Context& context, const char* format, T... values) {
  char line[400];
  std::snprintf(line, sizeof line, format, values...);
  context.text() << line;
}

}  // namespace fieldmark::cli
