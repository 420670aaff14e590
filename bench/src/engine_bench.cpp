#include <fieldmark/engine/error.h>

#include "rows.h"

namespace fieldmark::bench {

EngineBench run_engine_bench(const EngineBenchOptions& options,
                             const std::function<void(const std::string&, double)>& progress) {
  if (options.runs < 1 || !(options.scale > 0 && options.scale <= 1))
    throw ValueError("[engine_bench] runs must be at least 1 and scale in (0, 1], got " +
                     std::to_string(options.runs) + " and " + std::to_string(options.scale));
  std::vector<RowSpec> specs;
  for (auto list : {mlp_rows(), conv_rows(), hash_rows(), nerf_rows()})
    for (RowSpec& spec : list)
      if (spec.name.find(options.only) != std::string::npos) specs.push_back(std::move(spec));
  if (specs.empty()) throw ValueError("[engine_bench] only: no row has '" + options.only + "' in its name");
  EngineBench result;
  result.peak_gflops = peak_gflops();
  for (const RowSpec& spec : specs) {
    if (progress)
      progress(spec.name, static_cast<double>(result.rows.size()) / static_cast<double>(specs.size()));
    EngineRow row = spec.run(options);
    row.name = spec.name;
    row.what = spec.what;
    row.megabytes = peak_megabytes();
    result.rows.push_back(std::move(row));
  }
  return result;
}

}  // namespace fieldmark::bench
