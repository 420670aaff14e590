#include <fieldmark/core/error.h>
#include <fieldmark/core/private_folder.h>
#include <fieldmark/tools/bench/line_process.h>
#include <fieldmark/tools/bench/turns_bench.h>

#include <algorithm>

#include "timing.h"

namespace fieldmark::bench {
namespace {

constexpr std::string_view kFolder = "{}";

std::vector<std::string> command_in(const std::string& program, const std::vector<std::string>& arguments,
                                    const std::string& folder) {
  std::vector<std::string> command{program};
  for (std::string word : arguments) {
    for (auto at = word.find(kFolder); at != std::string::npos; at = word.find(kFolder, at + folder.size()))
      word.replace(at, kFolder.size(), folder);
    command.push_back(std::move(word));
  }
  return command;
}

double seconds_of_run(const std::string& program, const TurnsOptions& options,
                      const std::function<void()>& tick) {
  const PrivateFolder folder("turns");
  const double begin = now();
  LineProcess(command_in(program, options.arguments, folder.path.string()), {}, options.limit_seconds)
      .finish(tick);
  return now() - begin;
}

}  // namespace

Turns take_turns(const TurnsOptions& options, const std::function<void(double)>& progress) {
  if (options.runs < 1)
    throw ValueError("[take_turns] runs must be at least 1, got " + std::to_string(options.runs));
  Turns turns;
  for (Index i = 0; i < 2 * options.runs; ++i) {
    const auto tick = [&] { progress(static_cast<double>(i) / static_cast<double>(2 * options.runs)); };
    const bool ours = (i + i / 2) % 2 == 0;
    (ours ? turns.ours : turns.theirs)
        .push_back(seconds_of_run(ours ? options.ours : options.theirs, options, tick));
  }
  return turns;
}

TurnsRatio ratio_of(const Turns& turns) {
  if (turns.ours.empty() || turns.ours.size() != turns.theirs.size())
    throw ValueError("[ratio_of] both programs must have the same number of runs, at least 1, got " +
                     std::to_string(turns.ours.size()) + " and " + std::to_string(turns.theirs.size()));
  std::vector<double> ratios;
  for (std::size_t i = 0; i < turns.ours.size(); ++i) ratios.push_back(turns.ours[i] / turns.theirs[i]);
  return {.median = median(ratios),
          .low = std::ranges::min(ratios),
          .high = std::ranges::max(ratios),
          .of_least = std::ranges::min(turns.ours) / std::ranges::min(turns.theirs)};
}

}  // namespace fieldmark::bench
