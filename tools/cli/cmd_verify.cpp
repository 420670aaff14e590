#include <fieldmark/core/digest.h>
#include <fieldmark/watermark/evidence/commitment.h>
#include <fieldmark/watermark/evidence/evidence_folder.h>
#include <fieldmark/watermark/evidence/noise.h>

#include <cstdio>
#include <memory>
#include <optional>
#include <ostream>

#include <fieldmark/tools/results/report.h>
#include "cli/cli.h"
#include "cli/code_option.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/counted.h"
#include "cli/evidence_run.h"
#include "cli/rounded_up.h"

namespace fieldmark::cli {
namespace {

constexpr Index kEvidenceKeys = 100000;

struct VerifyArguments {
  std::string owner, evidence, reading = "auto";
  MessageOption message;
  CodeOption code;
  double fpr = 1e-6;
  std::optional<Index> wrong_keys;
  std::vector<std::string> controls;
  Suspects suspects;
};

watermark::WrongKeyCounts count_keys(const KeyTest& test, const std::vector<double>& evidence, Index n,
                                     Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("wrong keys");
  return watermark::count_wrong_keys(
      evidence, test.owner.cells.weights(), test.message, n, context.seed(), [&](Index done, Index total) {
        if (guard.interrupted()) throw Interrupted("nothing was decided");
        progress.update(static_cast<double>(done) / static_cast<double>(total));
        return true;
      });
}

void print_verdict(const watermark::EvidenceRecord& record, Context& context) {
  const auto& score = record.together;
  char head[120], text[400];
  std::snprintf(head, sizeof head, "%s at a false-positive rate of %g\n",
                record.found() ? "FOUND: the images carry a mark of this key," : "NOT FOUND", record.fpr);
  std::snprintf(
      text, sizeof text,
      "p-value of the key    %s (two-sided %s), from %s\n"
      "p-value of the bits   %s (two-sided %s), %lld of %lld match\n"
      "detection             %s\n",
      rounded_up(score.p_value, 3).c_str(), rounded_up(score.p_value_two_sided, 3).c_str(),
      (counted(std::ssize(record.images), "image") + (record.images.size() > 1 ? " together" : "")).c_str(),
      rounded_up(score.p_value_bits, 3).c_str(), rounded_up(score.p_value_bits_two_sided, 3).c_str(),
      static_cast<long long>(score.match.matching), static_cast<long long>(score.match.bits),
      record.reading.c_str());
  context.text() << head << verdict_sentence(score.p_value, record.fpr) << "\n"
                 << text << "owner sha256 " << record.owner_sha256 << "\ncommitment " << record.commitment
                 << "\n";
}

// The verdict is about the key. Says what speaks against the message.
void note_message(const watermark::EvidenceRecord& record, Context& context) {
  const auto& score = record.together;
  if (!record.found()) return;
  if (const Index against = watermark::contradicting_bits(score.reading, record.message); against > 0)
    context.note("bits that contradict the message: " + std::to_string(against) +
                 "; the images may carry another message of this key");
  const double noise = watermark::noise_p_value(score.reading);
  if (score.match.matching == score.match.bits && noise > record.fpr)
    context.note("unmarked images give bits as clear as these with p " + rounded_up(noise) +
                 ": this verdict counts only if the message was known before the images were read");
}

Json result_json(const watermark::EvidenceRecord& record, const std::string& signer) {
  const auto& score = record.together;
  return {{"found", record.found()},
          {"p_value", score.p_value},
          {"p_value_bits", score.p_value_bits},
          {"p_value_bits_two_sided", score.p_value_bits_two_sided},
          {"p_value_two_sided", score.p_value_two_sided},
          {"statistic", score.statistic},
          {"matching_bits", score.match.matching},
          {"contradicting_bits", watermark::contradicting_bits(score.reading, record.message)},
          {"bits", score.match.bits},
          {"p_noise", watermark::noise_p_value(score.reading)},
          {"views", record.images.size()},
          {"detection", record.reading},
          {"fpr", record.fpr},
          {"owner_sha256", record.owner_sha256},
          {"commitment", record.commitment},
          {"copy", record.copy.empty() ? Json(nullptr) : Json(record.copy)},
          {"public_key", signer},
          {"controls", controls_json(record.controls, record.fpr)}};
}

int run_verify(const VerifyArguments& options, Context& context) {
  auto owner = watermark::Owner::load(options.owner);
  const auto key = choose_code(options.code, options.message, owner, context);
  const auto message = message_of(options.message, owner.options().bits);
  const auto code = owner.code();
  check_rate(options.fpr, watermark::least_p(code.carriers()), code.carriers());
  if (!options.evidence.empty()) {
    if (!options.suspects.readings.empty())
      throw UsageError(
          "--readings: a signed record is of images that were read for it; leave out --evidence or "
          "--readings");
    watermark::prepare_evidence_folder(options.evidence);
  }
  SuspectReader reader(owner, options.reading);
  const auto images = read_images(reader, options.suspects, options.owner, context);
  const double seconds_per_image = reader.seconds_per_image();  // without the controls
  const auto evidence = total_evidence(images);
  const KeyTest test{owner, code, message};
  watermark::EvidenceRecord record{.reading = reading_used(images),
                                   .owner_sha256 = sha256_file_hex(options.owner),
                                   .message = message,
                                   .copy = options.code.copy,
                                   .key_free = owner.key_free(),
                                   .fpr = options.fpr,
                                   .cells = code.carriers(),
                                   .together = test(evidence),
                                   .images = score_images(test, images),
                                   .seed = context.seed(),
                                   .commit = results::machine().commit,
                                   .isa = results::machine().isa};
  record.commitment = watermark::commitment(record.owner_sha256, key, message);
  print_views(context.text(), images, record.images);
  print_verdict(record, context);
  note_message(record, context);
  TestedControls controls;
  if (!options.controls.empty() || !options.evidence.empty())
    controls = test_controls(test, reader, images, options.controls, options.suspects.frames, context);
  record.controls = controls.controls;
  print_controls(context.text(), record.controls, options.fpr);
  const Index keys = options.wrong_keys.value_or(options.evidence.empty() ? 0 : kEvidenceKeys);
  if (keys > 0) record.wrong_keys = count_keys(test, evidence, keys, context);
  const Json wrong =
      record.wrong_keys ? key_counts(*record.wrong_keys, "wrong keys", context) : Json(nullptr);
  const std::string signer = to_hex(watermark::public_key(key));
  if (!options.evidence.empty()) {
    write_evidence(options.evidence, record, images, controls.thumbnails, owner, key);
    context.text() << options.evidence << ": signed record with report.html, public key " << signer << "\n";
  }
  Json json = result_json(record, signer);
  json["seconds_per_image"] = number(seconds_per_image);
  json["payload"] = payload_json(message);
  json["wrong_keys"] = wrong;
  json["per_view"] = per_view_json(images, record.images);
  context.result(json);
  return record.found() ? kOk : kNotFound;
}

}  // namespace

Command add_verify(CommandLine& app) {
  auto o = std::make_shared<VerifyArguments>();
  app.add_option("--owner", o->owner, "Owner file from `fieldmark embed`")->required()->type_name("OWNER");
  add_message_options(app, o->message, "Message to look for, known before the images were read");
  add_rate(app, o->fpr, "a mark counts as found");
  add_code_options(app, o->code);
  add_copy_option(app, o->code, "Recipient whose copy to look for");
  app.add_option("--wrong-keys", o->wrong_keys,
                 "Random keys to test as well, 0 to 10000000; default: 0, or 100000 with --evidence")
      ->range(0, 10000000)
      ->type_name("N")
      ->default_str("");
  app.add_option("--control", o->controls,
                 "Unmarked image, video or folder to test in addition to the built-in controls; repeatable;\n"
                 "default: none")
      ->one_value()
      ->type_name("IMAGE|VIDEO|DIR")
      ->default_str("");
  app.add_option(
         "--evidence", o->evidence,
         "Folder to write a signed record to, with a page and a C2PA soft binding; new, empty or with "
         "earlier evidence; default: none")
      ->type_name("DIR")
      ->default_str("");
  add_reading(app, o->reading);
  add_suspects(app, o->suspects, "Images of one field, for one verdict")->required();
  return [o](Context& context) { return run_verify(*o, context); };
}

}  // namespace fieldmark::cli
