#include <fieldmark/watermark/baker.h>
#include <fieldmark/watermark/digest.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/measured.h"

namespace fieldmark::cli {
namespace {

namespace wm = watermark;

struct Options {
  std::string owner, message, out;
  wm::BakeOptions bake;
};

int run(Options options, Context& context) {
  check_writable(options.out);
  const auto owner = wm::Owner::load(options.owner);
  const wm::Message message = read_message(options.message, owner);
  options.bake.seed = context.seed();
  wm::Baker baker(owner, message, options.bake);
  {
    const InterruptGuard guard;
    Progress progress = context.progress("bake");
    while (!baker.done()) {
      if (guard.interrupted()) throw Interrupted("nothing was written yet");
      const double now = context.seconds();
      baker.step(now);
      char note[64];
      std::snprintf(note, sizeof note, "step %lld, %.2f dB from the mark",
                    static_cast<long long>(baker.steps()), baker.psnr());
      const Index planned = baker.planned();
      progress.update(planned > 0 ? static_cast<double>(baker.steps()) / static_cast<double>(planned)
                                  : now / options.bake.schedule.seconds,
                      note);
    }
  }
  const double seconds = context.seconds();
  baker.field().save(options.out);
  const std::string claim = wm::claim_digest(wm::sha256_file_hex(options.owner), owner.key, message);
  context.text()
      << options.out << ": message " << wm::to_hex(message) << " baked in " << format_duration(seconds)
      << "\nclaim to be time-stamped before the field is published (SHA-256 of owner, key and message):\n"
      << claim << "\n";
  context.result({{"message", wm::to_hex(message)},
                  {"steps", baker.steps()},
                  {"seconds", seconds},
                  {"psnr_mark", baker.psnr()},
                  {"claim", claim}});
  return kOk;
}

}  // namespace

Command add_bake(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--owner", o->owner, "The owner's secret file")->required()->type_name("OWNER");
  app.add_option("--message", o->message, "The message, hexadecimal, most significant bit first")
      ->required()
      ->type_name("HEX");
  app.add_option("--out", o->out, "File for the field to ship")->required()->type_name("FIELD");
  CLI::Option* steps =
      app.add_option("--steps", o->bake.schedule.steps, "Length of the run in steps, 1 to 10000000")
          ->check(CLI::Range(1, 10000000).description(""))
          ->type_name("N")
          ->default_str("");
  app.add_option("--seconds", o->bake.schedule.seconds, "Length of the run from its start, 1 to 1000000")
      ->check(CLI::Range(1.0, 1e6).description(""))
      ->excludes(steps)
      ->type_name("S");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
