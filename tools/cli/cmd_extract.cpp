#include <fieldmark/watermark/evidence/noise.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <ostream>

#include "cli/cli.h"
#include "cli/code_option.h"
#include "cli/commands.h"
#include "cli/context.h"
#include "cli/reading.h"
#include "cli/rounded_up.h"

namespace fieldmark::cli {
namespace {

constexpr double kWeakBit = 0.05;  // p-value above which a single bit is inconclusive
constexpr double kTrace = 0.01;    // p-value of noise below which something may be found

struct ExtractArguments {
  std::string owner, reading = "auto";
  CodeOption code;
  double fpr = 1e-6;
  Suspects suspects;
};

Json bits_json(const watermark::BitReading& reading) {
  return {{"bits", to_bits(reading.message)},
          {"payload", payload_json(read_payload(reading.sum))},
          {"p_noise", watermark::noise_p_value(reading)},
          {"bit_p_values", watermark::bit_p_values(reading)},
          {"logits", reading.logit}};
}

void print_view(const ImageEvidence& image, const watermark::BitReading& reading, Context& context) {
  context.text() << to_bits(reading.message) << "  " << image.image << "  "
                 << watermark::reading_name(image.reading) << ", noise with p "
                 << rounded_up(watermark::noise_p_value(reading)) << "\n";
}

// Describes how certain it is that the bits of all images together are a message.
std::string certainty(const watermark::BitReading& reading, double fpr) {
  const double p = watermark::noise_p_value(reading);
  const auto p_values = watermark::bit_p_values(reading);
  const auto weak = std::ranges::count_if(p_values, [](double bit) { return bit > kWeakBit; });
  char text[300];
  if (p <= fpr)
    std::snprintf(
        text, sizeof text,
        "READ at a false-positive rate of %g: unmarked images give such bits with p %s\n"
        "%lld of %zu bits %s (p above %g)\n",
        fpr, rounded_up(p).c_str(), static_cast<long long>(weak), p_values.size(),
        weak == 1 ? "is weak: by itself it may be wrong" : "are weak: by themselves they may be wrong",
        kWeakBit);
  else
    std::snprintf(
        text, sizeof text,
        "NOTHING READ at a false-positive rate of %g: unmarked images give such bits with p %s\n%s\n", fpr,
        rounded_up(p).c_str(),
        p <= kTrace ? "there may be a mark, too faint to be sure: more images of the field tell"
                    : "the bits above are guesses, not a message");
  return text;
}

int run_extract(const ExtractArguments& options, Context& context) {
  auto owner = watermark::Owner::load(options.owner);
  choose_code(options.code, {}, owner, context);
  const auto code = owner.code();
  const Index bits = owner.options().bits;
  const double least = watermark::least_noise_p(code.carriers(), bits);
  const bool can_tell = least < 1;  // with one cell per bit, a mark looks like noise
  if (can_tell) check_rate(options.fpr, least, code.carriers());
  SuspectReader reader(owner, options.reading);
  const auto images = read_images(reader, options.suspects, options.owner, context);
  Json views = Json::array();
  for (const auto& image : images) {
    const auto reading = watermark::read_bits(image.cells, code, bits);
    print_view(image, reading, context);
    Json view{{"image", image.image},
              {"time", number(image.time)},
              {"detection", watermark::reading_name(image.reading)},
              {"agreement", number(image.agreement)}};
    view.update(bits_json(reading));
    views.push_back(view);
  }
  const auto reading = watermark::read_bits(total_evidence(images), code, bits);
  const bool read = watermark::noise_p_value(reading) <= options.fpr;
  context.text() << to_bits(reading.message) << "  all together: " << to_hex(reading.message) << "\n"
                 << (can_tell || read
                         ? certainty(reading, options.fpr)
                         : "NOTHING READ: this owner has one cell for each bit, so bits alone do not "
                           "tell a message from noise; verify does, with the message\n")
                 << "payload: " << payload_text(read_payload(reading.sum), bits) << "\n";
  Json json{{"read", read},
            {"fpr", options.fpr},
            {"message", to_hex(reading.message)},
            {"detection", reading_used(images)},
            {"seconds_per_image", number(reader.seconds_per_image())}};
  json.update(bits_json(reading));
  json["views"] = views;
  context.result(json);
  return read ? kOk : kNotFound;
}

}  // namespace

Command add_extract(CommandLine& app) {
  auto o = std::make_shared<ExtractArguments>();
  app.add_option("--owner", o->owner, "Owner file from `fieldmark embed`")->required()->type_name("OWNER");
  add_code_options(app, o->code);
  add_copy_option(app, o->code, "Recipient whose copy to read");
  add_rate(app, o->fpr, "a message counts as read");
  add_reading(app, o->reading);
  add_suspects(app, o->suspects, "Images to read")->required();
  return [o](Context& context) { return run_extract(*o, context); };
}

}  // namespace fieldmark::cli
