#include <fieldmark/watermark/digest.h>
#include <fieldmark/watermark/wrong_keys.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/message_option.h"
#include "cli/reading.h"

namespace fieldmark::cli {
namespace {

struct Options {
  std::string owner, key;
  MessageOption message;
  double fpr = 1e-6;
  Index wrong_keys = 0;
  std::vector<std::string> images;
};

// How often keys that have nothing to do with the pictures reach each p-value, beside the most that chance
// allows.
Json wrong_keys(const Options& options, const watermark::Owner& owner, const std::vector<double>& evidence,
                const watermark::Message& message, Context& context) {
  if (options.wrong_keys == 0) return nullptr;
  const auto found =
      watermark::count_wrong_keys(evidence, owner.cells.area(), message, options.wrong_keys, context.seed());
  Json counts = Json::object(), bounds = Json::object();
  double p = 1;
  for (int i = 0; i < watermark::WrongKeyCounts::kThresholds; ++i) {
    p /= 10;
    const std::string name = "1e-" + std::to_string(i + 1);
    const Index count = found.counts[static_cast<std::size_t>(i)],
                bound = watermark::binomial_upper(found.n, p);
    counts[name] = count;
    bounds[name] = bound;
    char line[120];
    std::snprintf(line, sizeof line, "wrong keys at p <= %s   %lld of %lld, 99%% of the time at most %lld\n",
                  name.c_str(), static_cast<long long>(count), static_cast<long long>(found.n),
                  static_cast<long long>(bound));
    context.text() << line;
  }
  return {{"n", found.n}, {"counts", counts}, {"bounds_99", bounds}};
}

int run(const Options& options, Context& context) {
  const auto owner = watermark::Owner::load(options.owner);
  const Index bits = owner.options().bits;
  const auto message = message_of(options.message, bits);
  const auto key = options.key.empty() ? owner.key : watermark::load_key(options.key);
  const auto code = owner.code(key);
  const double least = watermark::least_p(code.carriers());
  if (least > options.fpr) {
    char text[120];
    std::snprintf(text, sizeof text, "--fpr: with %lld cells no picture can reach %g, the least is %.1e",
                  static_cast<long long>(code.carriers()), options.fpr, least);
    throw UsageError(text);
  }

  const auto pictures = read_pictures(owner, options.images, context);
  const auto evidence = total_evidence(pictures);
  const double statistic = watermark::keyed_statistic(evidence, code, message);
  const double p = watermark::keyed_p_value(statistic),
               two_sided = watermark::keyed_p_value_two_sided(statistic);
  const auto match = watermark::match_bits(watermark::read_bits(evidence, code, bits), message);
  const double p_bits = watermark::p_value_bits(match.matching, match.decided);
  const bool found = p <= options.fpr;
  const auto owner_sha256 = watermark::sha256_file_hex(options.owner);
  const auto claim = watermark::claim_digest(owner_sha256, key, message);

  char text[400];
  std::snprintf(text, sizeof text,
                "%s at a rate of false alarms of %g\n"
                "p-value, keyed        %.2e (two-sided %.2e), from %zu pictures together\n"
                "p-value, bits         %.2e, %lld of %lld match\n",
                found ? "FOUND" : "NOT FOUND", options.fpr, p, two_sided, pictures.size(), p_bits,
                static_cast<long long>(match.matching), static_cast<long long>(match.bits));
  context.text() << text << "owner sha256 " << owner_sha256 << "\nclaim " << claim << "\n";
  const Json wrong = wrong_keys(options, owner, evidence, message, context);
  context.result({{"found", found},
                  {"p_value", p},
                  {"p_value_bits", p_bits},
                  {"p_value_two_sided", two_sided},
                  {"matching_bits", match.matching},
                  {"bits", match.bits},
                  {"views", pictures.size()},
                  {"reading", "blind"},
                  {"fpr", options.fpr},
                  {"payload", payload_json(message)},
                  {"owner_sha256", owner_sha256},
                  {"claim", claim},
                  {"wrong_keys", wrong}});
  return found ? kOk : kNotFound;
}

}  // namespace

Command add_verify(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--owner", o->owner, "What `fieldmark embed` wrote")->required()->type_name("OWNER");
  add_message_options(app, o->message, "Message to look for");
  app.add_option("--fpr", o->fpr, "Rate of false alarms at which a mark counts as found, above 0 to 1")
      ->check(CLI::Range(1e-300, 1.0).description(""))
      ->type_name("P");
  app.add_option("--key", o->key, "Another key than the owner's")->type_name("KEY");
  app.add_option("--wrong-keys", o->wrong_keys, "Also test this many random keys, 0 to 10000000")
      ->check(CLI::Range(0, 10000000).description(""))
      ->type_name("N");
  app.add_option("images", o->images,
                 "Pictures of one field, or folders of them (PNG, JPEG): one verdict for all")
      ->required()
      ->type_name("IMAGE|DIR")
      ->default_str("");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
