#include <fieldmark/tools/bench/payload_bench.h>

#include "cli/bench.h"

namespace fieldmark::cli {
namespace {

constexpr Index kNoiseTrials = 10;  // readings of fair bits per trial of a row

Json layout_json(const watermark::PayloadLayout& l) {
  return {{"data_bits", l.data_bits},   {"check_bits", l.check_bits}, {"zero_bits", l.zero_bits},
          {"spare_bits", l.spare_bits}, {"corrects", l.corrects},     {"chance", l.chance}};
}

Json payload_row_json(const bench::PayloadRow& r) {
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

int run_bench_payload(Index bits, Index trials, Context& context) {
  const bench::PayloadBenchOptions options{
      .bits = bits, .trials = trials, .noise_trials = kNoiseTrials * trials, .seed = context.seed()};
  const auto result = read_option("--bits", [&] {
    return with_progress(context,
                         [&](const auto& progress) { return bench::run_payload_bench(options, progress); });
  });
  const auto number = [](Index n) { return static_cast<long long>(n); };
  print_line(context,
             "%lld data bits in %lld, %lld trials a row\nwrong bits   promised  from signs  from strengths\n",
             number(result.data_bits), number(bits), number(trials));
  Json layouts = Json::array(), rows = Json::array();
  for (const auto& l : result.layouts) layouts.push_back(layout_json(l));
  for (const auto& r : result.rows) {
    print_line(context, "%9.0f%%  %8.2f%%  %9.2f%%  %13.2f%%\n", 100 * r.error_rate, 100 * r.computed,
               100 * r.signs.share(), 100 * r.strengths.share());
    rows.push_back(payload_row_json(r));
  }
  const bench::PayloadNoise& n = result.noise;
  print_line(
      context,
      "fair bits read as a payload: %lld of %lld from signs, %lld from strengths; at most %.2g expected\n",
      number(n.signs), number(n.trials), number(n.strengths), n.bound * static_cast<double>(n.trials));
  context.result(
      {{"bits", bits},
       {"data_bits", result.data_bits},
       {"trials", trials},
       {"seed", context.seed()},
       {"fair_bits",
        {{"trials", n.trials}, {"signs", n.signs}, {"strengths", n.strengths}, {"chance_bound", n.bound}}},
       {"layouts", layouts},
       {"rows", rows}});
  return kOk;
}

}  // namespace

Command add_bench_payload(CommandLine& app) {
  struct Options {
    Index bits = 100, trials = 1000;
  };
  auto o = std::make_shared<Options>();
  add_number(app, "--bits", o->bits, 1, 256, "Length of the message in bits, 1 to 256");
  add_number(app, "--trials", o->trials, 1, 1000000, "Trials of each row, 1 to 1000000");
  return [o](Context& context) { return run_bench_payload(o->bits, o->trials, context); };
}

}  // namespace fieldmark::cli
