#include "cli/bench_payload.h"

#include <fieldmark/tools/bench/payload_bench.h>

#include <cstdio>
#include <ostream>

#include "cli/cli.h"
#include "cli/context.h"

namespace fieldmark::cli {
namespace {

constexpr Index kNoiseTrials = 10;  // of fair bits, for each trial of a row

Json layout_json(const watermark::PayloadLayout& l) {
  return {{"data_bits", l.data_bits},   {"check_bits", l.check_bits}, {"zero_bits", l.zero_bits},
          {"spare_bits", l.spare_bits}, {"corrects", l.corrects},     {"chance", l.chance}};
}

Json row_json(const bench::PayloadRow& r) {
  Json json{{"error_rate", r.error_rate}, {"computed", r.computed}};
  const auto add = [&](const std::string& name, const watermark::PayloadAccuracy& a) {
    const auto [low, high] = watermark::wilson_interval(a.exact, a.trials);
    json[name] = a.share();
    json[name + "_low"] = low;
    json[name + "_high"] = high;
    json[name + "_wrong"] = a.wrong;
  };
  add("signs", r.signs);
  add("strengths", r.strengths);
  return json;
}

}  // namespace

void add_bench_payload(CommandLine& app, BenchPayloadOptions& o) {
  app.add_option("--bits", o.bits, "payload, embed: length of a message, 1 to 256")
      ->range(1, 256)
      ->type_name("N")
      ->default_str("100; embed 16");
  app.add_option("--trials", o.trials, "payload: of each row, 1 to 1000000")
      ->range(1, 1000000)
      ->type_name("N");
}

int bench_payload(const BenchPayloadOptions& options, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("bench");
  const bench::PayloadBenchOptions bench{.bits = options.bits,
                                         .trials = options.trials,
                                         .noise_trials = kNoiseTrials * options.trials,
                                         .seed = context.seed()};
  const auto result = read_option("--bits", [&] {
    return bench::run_payload_bench(bench, [&](const std::string& what, double part) {
      if (guard.interrupted()) throw Interrupted("nothing was written");
      progress.update(part, what);
    });
  });
  Json layouts = Json::array(), rows = Json::array();
  for (const auto& l : result.layouts) layouts.push_back(layout_json(l));
  char line[200];
  std::snprintf(
      line, sizeof line,
      "%lld data bits in %lld, %lld trials a row\nwrong bits   promised  from signs  from strengths\n",
      static_cast<long long>(result.data_bits), static_cast<long long>(options.bits),
      static_cast<long long>(options.trials));
  context.text() << line;
  for (const auto& r : result.rows) {
    std::snprintf(line, sizeof line, "%9.0f%%  %8.2f%%  %9.2f%%  %13.2f%%\n", 100 * r.error_rate,
                  100 * r.computed, 100 * r.signs.share(), 100 * r.strengths.share());
    context.text() << line;
    rows.push_back(row_json(r));
  }
  const bench::PayloadNoise& n = result.noise;
  std::snprintf(line, sizeof line,
                "fair bits read as a payload: %lld of %lld from signs, %lld from strengths; at most %.2g of "
                "them expected\n",
                static_cast<long long>(n.signs), static_cast<long long>(n.trials),
                static_cast<long long>(n.strengths), n.bound * static_cast<double>(n.trials));
  context.text() << line;
  context.result(
      {{"bits", options.bits},
       {"data_bits", result.data_bits},
       {"trials", options.trials},
       {"seed", context.seed()},
       {"fair_bits",
        {{"trials", n.trials}, {"signs", n.signs}, {"strengths", n.strengths}, {"chance_bound", n.bound}}},
       {"layouts", layouts},
       {"rows", rows}});
  return kOk;
}

}  // namespace fieldmark::cli
