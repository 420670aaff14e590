#include <CLI/CLI.hpp>
#include <memory>
#include <optional>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/measured.h"

namespace fieldmark::cli {
namespace {

struct Options {
  std::string owner, field, message;
  MarkMeasure what;
};

int run(Options options, Context& context) {
  const auto owner = watermark::Owner::load(options.owner);
  std::optional<nerf::RadianceField> baked;
  std::optional<watermark::Message> message;
  if (!options.field.empty()) {
    message = read_message(options.message, owner);
    baked = nerf::RadianceField::load(options.field);
    options.what.baked = &*baked;
    options.what.message = &*message;
  }
  context.result(measure_mark(owner, options.what, context));
  return kOk;
}

}  // namespace

Command add_measure(CLI::App& app) {
  auto o = std::make_shared<Options>();
  app.add_option("--owner", o->owner, "The owner's secret file")->required()->type_name("OWNER");
  CLI::Option* field =
      app.add_option("--field", o->field, "Baked field (else every view gets a message of its own)")
          ->type_name("BAKED");
  CLI::Option* message =
      app.add_option("--message", o->message, "What was baked in, hexadecimal")->type_name("HEX");
  field->needs(message);
  message->needs(field);
  app.add_option("--cameras", o->what.cameras,
                 "near (drawn from the span of the training cameras), ring (30 degrees above,\n"
                 "radius 4.0311), sphere (all directions), test (of --data)")
      ->check(CLI::IsMember({"near", "ring", "sphere", "test"}).description(""))
      ->type_name("SET");
  app.add_option("--count", o->what.count, "Views to draw, 1 to 100000")
      ->check(CLI::Range(1, 100000).description(""))
      ->type_name("N");
  app.add_option("--size", o->what.size, "Pixels of the pictures' longer side, 16 to 8192 (as trained)")
      ->check(CLI::Range(16, 8192).description(""))
      ->type_name("N")
      ->default_str("");
  app.add_option("--under", o->what.under, "Measure under a distortion too, see attack; may be repeated")
      ->type_name("NAME");
  app.add_option("--data", o->what.data, "Data set, to compare with its test photographs")->type_name("DIR");
  return [o](Context& context) { return run(*o, context); };
}

}  // namespace fieldmark::cli
