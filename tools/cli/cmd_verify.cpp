#include <fieldmark/watermark/digest.h>
#include <fieldmark/watermark/wrong_keys.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/measured.h"
#include "cli/reading.h"

namespace fieldmark::cli {
namespace {

namespace wm = watermark;

struct Options {
  std::string owner, message, key;
  std::vector<std::string> pictures;
  double fpr = 1e-6;
  Index wrong_keys = 0;
};

// A rate that no picture could ever meet is a mistake of the question, not an answer about the pictures.
void check_rate(double fpr, const wm::CellCode& code) {
  const double least = wm::least_p(code.carriers());
  if (fpr >= least) return;
  char text[160];
  std::snprintf(text, sizeof text,
                "--fpr: must be at least %.3g, which is the least that %lld cells can show, got %.3g", least,
                static_cast<long long>(code.carriers()), fpr);
  throw UsageError(text);
}

Json wrong_keys(const Options& options, const wm::Owner& owner, const wm::Message& message,
                const Readings& readings, Context& context) {
  const auto counts =
      wm::count_wrong_keys(readings.sum, owner.cells.area(), message, options.wrong_keys, context.seed());
  Json json{{"n", counts.n}, {"counts", Json::object()}, {"bound_99", Json::object()}};
  double p = 1;
  for (std::size_t i = 0; i < counts.counts.size(); ++i) {
    p /= 10;
    const std::string name = "1e-" + std::to_string(i + 1);
    json["counts"][name] = counts.counts[i];
    json["bound_99"][name] = wm::binomial_upper(counts.n, p);
    char line[100];
    std::snprintf(line, sizeof line,
                  "  p <= %s: %lld of %lld wrong keys (99%% bound of a fair count: %lld)\n", name.c_str(),
                  static_cast<long long>(counts.counts[i]), static_cast<long long>(counts.n),
                  static_cast<long long>(wm::binomial_upper(counts.n, p)));
    context.text() << line;
  }
  return json;
}

int run(const Options& options, Context& context) {
  const auto owner = wm::Owner::load(options.owner);
  const wm::Message message = read_message(options.message, owner);
  const wm::Key key = options.key.empty() ? owner.key : wm::load_key(options.key);
  const wm::CellCode code = owner.code(key);
  check_rate(options.fpr, code);
  const auto readings = read_pictures(owner, options.pictures, context);
  const double statistic = wm::keyed_statistic(readings.sum, code, message);
  const double p = wm::keyed_p_value(statistic), two_sided = wm::keyed_p_value_two_sided(statistic);
  const auto match = wm::match_bits(wm::read_bits(readings.sum, code, owner.options().bits), message);
  const double p_bits = wm::p_value_bits(match.matching, match.decided);
  const bool found = p <= options.fpr;
  const std::string claim = wm::claim_digest(wm::sha256_file_hex(options.owner), key, message);
  char line[300];
  std::snprintf(line, sizeof line,
                "%s: p = %.3g (two-sided %.3g) against a rate of %.3g, from %zu pictures read blind\n"
                "  %lld of %lld bits match: p = %.3g\n",
                found ? "MARK FOUND" : "no mark found", p, two_sided, options.fpr, readings.each.size(),
                static_cast<long long>(match.matching), static_cast<long long>(match.bits), p_bits);
  context.text() << line << "  claim (SHA-256 of owner, key and message): " << claim << "\n";
  Json json{{"found", found},
            {"p_value", p},
            {"p_value_bits", p_bits},
            {"p_value_bits_two_sided", wm::p_value_bits_two_sided(match.matching, match.decided)},
            {"p_value_two_sided", two_sided},
            {"statistic", statistic},
            {"matching_bits", match.matching},
            {"bits", match.bits},
            {"views", readings.each.size()},
            {"reading", "blind"},
            {"fpr", options.fpr},
            {"claim", claim},
            {"wrong_keys", nullptr}};
  if (options.wrong_keys > 0) json["wrong_keys"] = wrong_keys(options, owner, message, readings, context);
  context.result(json);
  return found ? kOk : kNotFound;
}

}  // namespace

Command add_verify(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--owner", o->owner, "The owner's secret file")->required()->type_name("OWNER");
  app.add_option("--message", o->message, "The message that is claimed, hexadecimal")
      ->required()
      ->type_name("HEX");
  app.add_option("--fpr", o->fpr, "Rate of false alarms that is accepted, above 0 and at most 1")
      ->check(CLI::Range(1e-300, 1.0).description(""))
      ->type_name("P");
  app.add_option("--key", o->key, "KEY file to test instead of the owner's key")->type_name("KEY");
  app.add_option("--wrong-keys", o->wrong_keys,
                 "Also count how many of N random keys find a mark, 0 to 100000000")
      ->check(CLI::Range(0, 100000000).description(""))
      ->type_name("N");
  app.add_option("pictures", o->pictures, "Pictures, or folders of them")->required()->type_name("IMAGE|DIR");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
