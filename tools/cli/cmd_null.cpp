#include <fieldmark/nerf/camera_set.h>
#include <fieldmark/watermark/evidence/wrong_keys.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/code_option.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/evidence_run.h"
#include "cli/images.h"

namespace fieldmark::cli {
namespace {

struct NullArguments {
  std::string owner, reading = "auto";
  MessageOption message;
  CodeOption code;
  Index keys = 20, novel = 0;
  Suspects suspects;
};

// Reads unmarked novel views of the owner's own field.
void read_novel(SuspectReader& reader, const watermark::Owner& owner, Index count,
                std::vector<ImageEvidence>& read, Context& context) {
  const InterruptGuard guard;
  Progress progress = context.progress("novel views");
  nerf::Renderer renderer(owner.field);
  for (const auto& camera :
       nerf::make_cameras(owner.field.cameras, nerf::CameraSet::novel, count, 0, context.seed() + 2)) {
    if (guard.interrupted()) throw Interrupted("nothing was counted");
    read.push_back(reader.read(renderer.render(camera).rgb, "novel " + std::to_string(read.size() + 1)));
    progress.update(static_cast<double>(read.size()) / static_cast<double>(count));
  }
}

int run_null(const NullArguments& options, Context& context) {
  if (options.suspects.paths.empty() && options.novel == 0)
    throw UsageError("images: expected unmarked images or --novel N, got neither");
  if (options.suspects.paths.empty() && (options.suspects.frames || !options.suspects.readings.empty()))
    throw UsageError(std::string(options.suspects.frames ? "--frames" : "--readings") +
                     ": needs images or videos, got none");
  if (!options.suspects.readings.empty())
    check_writable_page(options.suspects.readings);  // before novel views
  auto owner = watermark::Owner::load(options.owner);
  choose_code(options.code, options.message, owner, context);
  const Index bits = owner.options().bits;
  const auto message = options.message.given()
                           ? message_of(options.message, bits)
                           : watermark::random_message(bits, CounterRng(context.seed(), 53), 0);
  SuspectReader reader(owner, options.reading);
  std::vector<ImageEvidence> read;
  read_novel(reader, owner, options.novel, read, context);
  if (!options.suspects.paths.empty())
    for (auto& image : read_images(reader, options.suspects, options.owner, context))
      read.push_back(std::move(image));

  if (options.novel > 1 ||
      std::ranges::any_of(read, [](const ImageEvidence& image) { return !std::isnan(image.time); }))
    context.note(
        "views of one field and frames of one video are not independent trials: counts of the key may exceed "
        "their bounds more often than 1% of the time; those of random keys do not");
  const auto code = owner.code();
  watermark::WrongKeyCounts right, random;
  const InterruptGuard guard;
  Progress progress = context.progress("random keys");
  for (std::size_t i = 0; i < read.size(); ++i) {
    right.add(watermark::keyed_statistic(read[i].cells, code, message));
    // Each image has its own keys, so that all trials are independent given the images.
    random.add(watermark::count_wrong_keys(
        read[i].cells, owner.cells.weights(), message, options.keys, context.seed() + i + 1,
        [&](Index done, Index total) {
          if (guard.interrupted()) throw Interrupted("nothing was counted");
          const double part = static_cast<double>(done) / static_cast<double>(total);
          progress.update((static_cast<double>(i) + part) / static_cast<double>(read.size()));
          return true;
        }));
  }
  context.text() << read.size() << " unmarked images, detection " << reading_used(read) << "\n";
  Json json = key_counts(right, "the key", context);
  json["bounds"] = json["bounds_99"];
  if (options.keys > 0) json["random_keys"] = key_counts(random, "random keys", context);
  json["detection"] = reading_used(read);
  json["key_free"] = owner.key_free();
  context.result(json);
  return kOk;
}

}  // namespace

Command add_null(CommandLine& app) {
  auto o = std::make_shared<NullArguments>();
  app.add_option("--owner", o->owner, "Owner file from `fieldmark embed`")->required()->type_name("OWNER");
  add_message_options(app, o->message, "Message to test, at random unless given");
  add_code_options(app, o->code);
  app.add_option("--keys", o->keys, "Random keys to test on each image as well, 0 to 10000000")
      ->range(0, 10000000)
      ->type_name("N");
  app.add_option("--novel", o->novel,
                 "Novel views of the owner's unmarked field to render and test, 0 to 100000")
      ->range(0, 100000)
      ->type_name("N");
  add_reading(app, o->reading);
  add_suspects(app, o->suspects, "Images that do not show the mark");
  return [o](Context& context) { return run_null(*o, context); };
}

}  // namespace fieldmark::cli
