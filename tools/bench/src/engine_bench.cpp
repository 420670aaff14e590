#include <fieldmark/core/error.h>
#include <fieldmark/core/number_text.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "rows.h"

namespace fieldmark::bench {
namespace {

EngineRow run_row(const RowSpec& spec, const EngineBenchOptions& options) {
  RowOptions o{options};
  if (!options.peer || !spec.work) return spec.run(o);
  Peer peer(spec.name, spec.work(o), *options.peer);
  std::vector<double> seconds;
  // Threads of either side spin for a while after their work, and would slow down the other.
  const auto rest = [] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); };
  o.between = [&] {
    rest();
    seconds.push_back(peer.run());
    rest();
  };
  EngineRow row = spec.run(o);
  const double theirs = median(seconds);
  row.peer = PeerRow{theirs, theirs / row.seconds, peer.found()};
  return row;
}

}  // namespace

EngineBench run_engine_bench(const EngineBenchOptions& options,
                             const std::function<void(const std::string&, double)>& progress) {
  if (options.runs < 1 || !(options.scale > 0 && options.scale <= 1))
    throw ValueError("[engine_bench] runs must be at least 1 and scale in (0, 1], got " +
                     std::to_string(options.runs) + " and " + number_text(options.scale));
  std::vector<RowSpec> specs;
  for (auto list : {mlp_rows(), conv_rows(), model_rows(), chain_rows(), hash_rows(), nerf_rows()})
    for (RowSpec& spec : list)
      if (spec.name.find(options.only) != std::string::npos) specs.push_back(std::move(spec));
  if (specs.empty()) throw ValueError("[engine_bench] only: no row has '" + options.only + "' in its name");
  if (options.peer && std::none_of(specs.begin(), specs.end(), [](const auto& s) { return bool(s.work); }))
    throw ValueError("[engine_bench] peer: no row with '" + options.only + "' in its name has one");
  EngineBench result;
  result.peak_gflops = peak_gflops();
  for (const RowSpec& spec : specs) {
    if (progress)
      progress(spec.name, static_cast<double>(result.rows.size()) / static_cast<double>(specs.size()));
    EngineRow row = run_row(spec, options);
    row.name = spec.name;
    if (row.what.empty()) row.what = spec.what;
    row.megabytes = peak_megabytes();
    result.rows.push_back(std::move(row));
  }
  return result;
}

}  // namespace fieldmark::bench
