#include <fieldmark/core/digest.h>
#include <fieldmark/watermark/embedding/baker.h>
#include <fieldmark/watermark/evidence/commitment.h>
#include <fieldmark/watermark/keys/signing.h>
#include <fieldmark/watermark/tracing/copies.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <ostream>

#include "cli/cli.h"
#include "cli/code_option.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/long_run.h"

namespace fieldmark::cli {
namespace {

constexpr double kMuchFainter = 2;  // dB: the usual loss from learning is at most 1.3

struct BakeArguments {
  std::string owner, out;
  std::optional<double> mark_psnr;
  MessageOption message;
  CodeOption code;
  RunLength length{.seconds = watermark::BakeOptions{}.schedule.seconds};
  bool resume = false;
};

watermark::Baker::MarkPsnr scaled_to(const watermark::Owner& owner, watermark::Baker& baker) {
  if (owner.mark().has_gain()) return baker.scale_to(owner.options().mark_psnr);
  const double mark_psnr = baker.mark_psnr();  // determined by the networks
  return {.learnt = mark_psnr, .scaled = mark_psnr};
}

// Prints the mark PSNR of the file and the one requested; notes if little of the mark was learned.
void say_strength(const watermark::Owner& owner, const watermark::Baker::MarkPsnr& mark_psnr,
                  Context& context) {
  char line[320];
  std::snprintf(line, sizeof line, "mark PSNR %.1f dB on the foreground", mark_psnr.scaled);
  context.text() << line;
  const double asked = owner.options().mark_psnr, fainter = mark_psnr.learnt - asked;
  if (!owner.mark().has_gain()) {
    context.text() << "\n";
    return;
  }
  std::snprintf(line, sizeof line, ", %.1f dB requested\n", asked);
  context.text() << line;
  if (!(fainter > kMuchFainter)) return;
  std::snprintf(
      line, sizeof line,
      "the colours of the file learned only %.0f%% of the mark, which was scaled by %.2f together with its "
      "errors: a longer --seconds, a larger field or a lower --mark-psnr helps",
      100 * std::pow(10.0, -fainter / 20), mark_psnr.scale);
  context.note(line);
}

int run_bake(const BakeArguments& options, Context& context) {
  const std::string checkpoint = options.out + ".checkpoint";
  if (std::filesystem::exists(options.out) && std::filesystem::equivalent(options.out, options.owner))
    throw UsageError("--out: " + options.out + " is the owner's file");
  check_writable(options.out);
  if (!options.resume) check_new_checkpoint(checkpoint);
  auto owner = watermark::Owner::load(options.owner);
  if (options.mark_psnr) {
    if (!owner.mark().has_gain())
      throw UsageError("--mark-psnr: an owner of preset " + owner.mark().preset() +
                       " has no mark PSNR to set, its networks decide it");
    owner.set_mark_psnr(*options.mark_psnr);
  }
  if (!options.code.copy.empty())
    read_option("--copy", [&] { watermark::check_recipient(options.code.copy); });
  const auto key = choose_code(options.code, options.message, owner, context);
  const auto message = message_of(options.message, owner.options().bits);
  watermark::BakeOptions bake_options{.seed = context.seed()};
  bake_options.schedule.steps = options.length.steps;
  bake_options.schedule.seconds = options.length.seconds;
  watermark::Baker baker(owner, message, bake_options);
  const InterruptGuard until_saved;  // Ctrl-C waits between the last step and the file
  if (options.resume) baker.restore(checkpoint);
  const double seconds = run_long(baker, "bake", options.length, context, checkpoint);
  const auto mark_psnr = scaled_to(owner, baker);
  baker.field().save(options.out);
  std::filesystem::remove(checkpoint);

  const auto owner_sha256 = sha256_file_hex(options.owner);
  const auto commitment = watermark::commitment(owner_sha256, key, message);
  const auto open = to_hex(watermark::public_key(key));
  const auto bytes = std::filesystem::file_size(options.out);
  context.text() << options.out << ": " << baker.steps() << " steps in " << format_duration(seconds)
                 << "\ncommitment " << commitment
                 << ", time-stamp it before you publish the field\npublic key " << open
                 << ", time-stamp it too\n";
  say_strength(owner, mark_psnr, context);
  context.result({{"message", to_hex(message)},
                  {"payload", payload_json(message)},
                  {"bits", message.size()},
                  {"copy", options.code.copy.empty() ? Json(nullptr) : Json(options.code.copy)},
                  {"seconds", seconds},
                  {"steps", baker.steps()},
                  {"psnr_colours", number(baker.psnr())},
                  {"mark_psnr", number(mark_psnr.scaled)},
                  {"mark_psnr_learnt", number(mark_psnr.learnt)},
                  {"scale", mark_psnr.scale},
                  {"emphasis", baker.emphasis()},
                  {"file_bytes", bytes},
                  {"owner_sha256", owner_sha256},
                  {"commitment", commitment},
                  {"public_key", open}});
  return kOk;
}

}  // namespace

Command add_bake(CommandLine& app) {
  auto o = std::make_shared<BakeArguments>();
  app.add_option("--owner", o->owner, "Owner file from `fieldmark embed`")->required()->type_name("OWNER");
  add_message_options(app, o->message, "Message to bake");
  add_code_options(app, o->code);
  add_copy_option(app, o->code, "Recipient whose own copy this is, see trace");
  app.add_option("--out", o->out, "Field file to publish; FIELD.checkpoint during baking")
      ->required()
      ->type_name("FIELD");
  app.add_option("--mark-psnr", o->mark_psnr,
                 "Mark PSNR on the foreground in dB, 20 to 60; higher is fainter; default: that of embed")
      ->range(20.0, 60.0)
      ->type_name("DB");
  add_run_length(app, o->length, true);
  app.add_flag("--resume", o->resume,
               "Resume from FIELD.checkpoint; repeat the options of the interrupted run");
  return [o](Context& context) { return run_bake(*o, context); };
}

}  // namespace fieldmark::cli
