#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/message_option.h"
#include "cli/reading.h"

namespace fieldmark::cli {
namespace {

struct ExtractArguments {
  std::string owner, reading = "auto";
  std::vector<std::string> images;
};

int run_extract(const ExtractArguments& options, Context& context) {
  const auto owner = watermark::Owner::load(options.owner);
  SuspectReader reader(owner, options.reading);
  const auto images = read_images(reader, options.images, context);
  const auto code = owner.code();
  const Index bits = owner.options().bits;
  Json views = Json::array();
  for (const auto& image : images) {
    const auto reading = watermark::read_bits(image.cells, code, bits);
    const char* how = watermark::reading_name(image.reading);
    context.text() << to_bits(reading.message) << "  " << image.image << "  " << how << "\n";
    views.push_back({{"image", image.image},
                     {"bits", to_bits(reading.message)},
                     {"detection", how},
                     {"agreement", number(image.agreement)},
                     {"payload", payload_json(read_payload(reading.sum))},
                     {"p_noise", watermark::bit_p_values(reading)},
                     {"logits", reading.logit}});
  }
  const auto reading = watermark::read_bits(total_evidence(images), code, bits);
  const auto payload = read_payload(reading.sum);
  context.text() << to_bits(reading.message) << "  all together: " << to_hex(reading.message)
                 << "\npayload: " << payload_text(payload, bits) << "\n";
  context.result({{"message", to_hex(reading.message)},
                  {"bits", to_bits(reading.message)},
                  {"payload", payload_json(payload)},
                  {"detection", reading_used(images)},
                  {"p_noise", watermark::bit_p_values(reading)},
                  {"logits", reading.logit},
                  {"views", views}});
  return kOk;
}

}  // namespace

Command add_extract(CommandLine& app) {
  auto o = std::make_shared<ExtractArguments>();
  app.add_option("--owner", o->owner, "Owner file of `fieldmark embed`")->required()->type_name("OWNER");
  add_reading(app, o->reading);
  app.add_option("images", o->images, "Images to read, or folders of them; PNG or JPEG")
      ->required()
      ->type_name("IMAGE|DIR")
      ->default_str("");
  return [o](Context& context) { return run_extract(*o, context); };
}

}  // namespace fieldmark::cli
