#include <fieldmark/core/digest.h>
#include <fieldmark/watermark/evidence/commitment.h>
#include <fieldmark/watermark/tracing/copies.h>
#include <fieldmark/watermark/tracing/trace.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/code_option.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/fingerprints.h"
#include "cli/reading.h"
#include "cli/rounded_up.h"

namespace fieldmark::cli {
namespace {

constexpr std::size_t kShown = 10;  // recipients not found that the text lists; JSON has all

struct TraceArguments {
  std::string owner, copies, reading = "auto";
  MessageOption message;
  CodeOption code;
  double fpr = 1e-6;
  Suspects suspects;
};

std::vector<watermark::TracedCopy> traced(const watermark::Owner& owner, const watermark::Key& key,
                                          const watermark::Message& message,
                                          const std::vector<std::string>& names,
                                          const std::vector<double>& evidence, double fpr, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("recipients");
  return watermark::trace_copies(evidence, owner.cells.weights(), key, message, names, fpr,
                                 [&](Index done, Index total) {
                                   if (guard.interrupted()) throw Interrupted("nothing was decided");
                                   progress.update(static_cast<double>(done) / static_cast<double>(total));
                                   return true;
                                 });
}

void print_recipients(const std::vector<watermark::TracedCopy>& copies, std::size_t found, double fpr,
                      Context& context) {
  char line[120];
  std::snprintf(line, sizeof line, "%zu of %zu recipients found at a corrected p of %g\n", found,
                copies.size(), fpr);
  context.text() << (found > 0 ? "FOUND: " : "NOT FOUND: ") << line;
  for (std::size_t i = 0; i < std::min(copies.size(), found + kShown); ++i) {
    std::snprintf(line, sizeof line, "%-9s corrected p %s, p %s  ", i < found ? "found" : "not found",
                  rounded_up(copies[i].p_corrected, 3).c_str(), rounded_up(copies[i].p_value, 3).c_str());
    context.text() << line << copies[i].name << "\n";
  }
}

int run_trace(const TraceArguments& options, Context& context) {
  auto owner = watermark::Owner::load(options.owner);
  check_copies(owner);
  const auto key = choose_code(options.code, options.message, owner, context);
  const auto message = message_of(options.message, owner.options().bits);
  const auto names = watermark::read_recipients(options.copies);
  // In the first round the least p-value counts twice for each name; later rounds ask for more.
  const Index carriers = owner.code().carriers();
  const double least = watermark::sharp_p_value(std::sqrt(static_cast<double>(carriers)));
  check_rate(options.fpr, std::min(1.0, 2 * static_cast<double>(names.size()) * least), carriers);
  SuspectReader reader(owner, options.reading);
  const auto images = read_images(reader, options.suspects, options.owner, context);
  const auto copies = traced(owner, key, message, names, total_evidence(images), options.fpr, context);
  std::size_t found = 0;
  Json recipients = Json::array();
  for (const auto& copy : copies) {
    const bool is_found = copy.p_corrected <= options.fpr;
    found += is_found;
    recipients.push_back({{"name", copy.name},
                          {"p_value", copy.p_value},
                          {"p_corrected", copy.p_corrected},
                          {"statistic", copy.statistic},
                          {"round", copy.round},
                          {"found", is_found}});
  }
  print_recipients(copies, found, options.fpr, context);
  const std::string list_sha256 = recipients_sha256(names), owner_sha256 = sha256_file_hex(options.owner),
                    commitment = watermark::commitment(owner_sha256, key, message);
  context.text() << "list sha256  " << list_sha256 << "\nowner sha256 " << owner_sha256 << "\ncommitment   "
                 << commitment << "\n";
  context.result({{"recipients", recipients},
                  {"tested", names.size()},
                  {"found", found},
                  {"fpr", options.fpr},
                  {"views", images.size()},
                  {"detection", reading_used(images)},
                  {"list_sha256", list_sha256},
                  {"owner_sha256", owner_sha256},
                  {"commitment", commitment}});
  return found > 0 ? kOk : kNotFound;
}

}  // namespace

Command add_trace(CommandLine& app) {
  auto o = std::make_shared<TraceArguments>();
  app.add_option("--owner", o->owner, "Owner file from `fieldmark embed`")->required()->type_name("OWNER");
  add_message_options(app, o->message, "Message of the copies");
  app.add_option("--copies", o->copies, "Text file of recipients, one NAME of `bake --copy` per line")
      ->required()
      ->type_name("FILE");
  app.add_option("--fpr", o->fpr,
                 "Bound on the probability of naming any innocent recipient, 1e-300 to 1; the largest "
                 "corrected p-value that counts as found")
      ->range(1e-300, 1.0)
      ->type_name("P");
  add_code_options(app, o->code);
  add_reading(app, o->reading);
  add_suspects(app, o->suspects, "Images of one field")->required();
  return [o](Context& context) { return run_trace(*o, context); };
}

}  // namespace fieldmark::cli
