#include <fieldmark/tools/bench/tracing_bench.h>
#include <fieldmark/watermark/attacks/payload_trials.h>

#include "cli/bench.h"
#include "cli/code_option.h"
#include "cli/owner_note.h"

namespace fieldmark::cli {
namespace {

constexpr const char* kColumns =
    "all_found: repetitions in which every guilty recipient was found, with its 95% interval; found: share "
    "of "
    "guilty recipients found; worst_guilty, least_innocent: largest corrected p-value of a guilty recipient "
    "and "
    "smallest of an innocent one, over all repetitions; innocents_named: innocent recipients found";

struct BenchTracingArguments {
  std::string owner, key;
  bool blind = false;
  bench::TracingBenchOptions options;
};

Json tracing_row_json(const bench::TracingRow& r) {
  const Index guilty = r.repetitions * r.copies.guilty;
  const auto [low, high] = watermark::wilson_interval(r.all_found, r.repetitions);
  return {{"copies", r.copies.name()},
          {"guilty", r.copies.guilty},
          {"repetitions", r.repetitions},
          {"all_found", r.all_found},
          {"all_found_low", low},
          {"all_found_high", high},
          {"found", static_cast<double>(r.found) / static_cast<double>(guilty)},
          {"worst_guilty", r.worst_guilty},
          {"least_innocent", r.least_innocent},
          {"innocents_named", r.innocents_named}};
}

int run_bench_tracing(const BenchTracingArguments& o, Context& context) {
  const auto owner = keyed_owner(o.owner, o.key, context);
  check_copies(owner);
  bench::TracingBenchOptions options = o.options;
  options.informed = !o.blind;
  options.seed = context.seed();
  const auto rows = with_progress(
      context, [&](const auto& progress) { return bench::run_tracing_bench(owner, options, progress); });
  print_line(context,
             "%lld recipients, %lld views, detection %s, found at a corrected p of at most %g, not baked\n",
             static_cast<long long>(options.recipients), static_cast<long long>(options.views),
             o.blind ? "blind" : "auto", options.fpr);
  print_line(context,
             "copies          all found  guilty found  worst guilty p  least innocent p  innocents named\n");
  Json json = Json::array();
  for (const auto& r : rows) {
    const Json row = tracing_row_json(r);
    print_line(context, "%-15s %3lld of %-3lld %12.1f%%  %14.2e  %16.2e  %15lld\n", r.copies.name().c_str(),
               static_cast<long long>(r.all_found), static_cast<long long>(r.repetitions),
               100 * row["found"].get<double>(), r.worst_guilty, r.least_innocent,
               static_cast<long long>(r.innocents_named));
    json.push_back(row);
  }
  context.result({{"recipients", options.recipients},
                  {"repetitions", options.repetitions},
                  {"views", options.views},
                  {"detection", o.blind ? "blind" : "auto"},
                  {"fpr", options.fpr},
                  {"baked", false},
                  {"seed", options.seed},
                  {"columns", kColumns},
                  {"rows", json}});
  return kOk;
}

}  // namespace

Command add_bench_tracing(CommandLine& app) {
  auto o = std::make_shared<BenchTracingArguments>();
  app.add_option("--owner", o->owner, "Owner file from `fieldmark embed`")->required()->type_name("OWNER");
  add_key_option(app, o->key);
  add_number(app, "--recipients", o->options.recipients, 9, 10000000, "Recipients to test, 9 to 10000000");
  add_number(app, "--repetitions", o->options.repetitions, 1, 100000,
             "Repetitions of each case with another key, 1 to 100000");
  add_number(app, "--views", o->options.views, 1, 10000, "Novel views whose evidence is added, 1 to 10000");
  app.add_option("--fpr", o->options.fpr,
                 "Bound on the probability of naming any innocent recipient, above 0 to 1; the largest "
                 "corrected p-value that counts as found")
      ->range(1e-300, 1.0)
      ->type_name("P");
  app.add_flag("--blind", o->blind, "Read by blind detection alone");
  return [o](Context& context) { return run_bench_tracing(*o, context); };
}

}  // namespace fieldmark::cli
