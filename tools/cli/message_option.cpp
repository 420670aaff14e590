#include "cli/message_option.h"
#include "cli/rounded_up.h"

#include <cstdio>

#include "cli/cli.h"

namespace fieldmark::cli {
namespace {

using watermark::PayloadKind;

watermark::Message encoded(const char* option, PayloadKind kind, const std::string& value, Index bits) {
  return read_option(
      option, [&] { return watermark::PayloadCodec(bits).encode(watermark::parse_payload(kind, value)); });
}

}  // namespace

void add_message_options(CommandLine& app, MessageOption& o, const std::string& purpose) {
  Option all[] = {
      app.add_option("--message", o.message, purpose + ", in hexadecimal, most significant bit first")
          ->type_name("HEX"),
      app.add_option("--text", o.text, "UTF-8 text instead of --message, encoded with error correction")
          ->type_name("TEXT"),
      app.add_option("--uuid", o.uuid,
                     "UUID instead of --message, encoded with error correction; needs 147 bits or more")
          ->type_name("UUID"),
      app.add_option("--payload", o.payload,
                     "1 to 32 hexadecimal digits instead of --message, encoded with error correction")
          ->type_name("HEX")};
  for (std::size_t i = 0; i < std::size(all); ++i)
    for (std::size_t j = i + 1; j < std::size(all); ++j) all[i]->excludes(all[j]);
}

watermark::Message message_of(const MessageOption& o, Index bits) {
  if (!o.text.empty()) return encoded("--text", PayloadKind::text, o.text, bits);
  if (!o.uuid.empty()) return encoded("--uuid", PayloadKind::uuid, o.uuid, bits);
  if (!o.payload.empty()) return encoded("--payload", PayloadKind::hex, o.payload, bits);
  if (o.message.empty()) throw UsageError("one of --message, --text, --uuid and --payload is needed");
  return read_option("--message", [&] { return watermark::message_from_hex(o.message, bits); });
}

Json payload_json(const watermark::Message& message) {
  if (message.size() > kMostPayloadBits) return nullptr;
  const auto payload = watermark::PayloadCodec(message.size()).payload(message);
  if (!payload) return nullptr;
  return {{"kind", watermark::payload_kind_name(payload->kind)}, {"value", payload->value}};
}

std::optional<watermark::PayloadReading> read_payload(const std::vector<double>& logit) {
  if (std::ssize(logit) > kMostPayloadBits) return std::nullopt;
  return watermark::PayloadCodec(static_cast<Index>(logit.size())).read(logit);
}

Json payload_json(const std::optional<watermark::PayloadReading>& reading) {
  if (!reading) return nullptr;
  return {{"kind", watermark::payload_kind_name(reading->payload.kind)},
          {"value", reading->payload.value},
          {"corrected", reading->corrected},
          {"chance", reading->chance}};
}

std::string payload_text(const std::optional<watermark::PayloadReading>& reading, Index bits) {
  if (!reading) {
    if (bits > kMostPayloadBits) return "none: a payload needs a message of at most 256 bits";
    const watermark::PayloadCodec codec(bits);
    if (codec.layouts().empty()) return "none: a message of so few bits holds no payload";
    char text[80];
    std::snprintf(text, sizeof text, "none (random bits decode to one with a probability of at most %s)",
                  rounded_up(codec.chance()).c_str());
    return text;
  }
  char text[120];
  std::snprintf(text, sizeof text,
                ", %lld of %lld bits corrected, by chance with a probability of at most %s",
                static_cast<long long>(reading->corrected), static_cast<long long>(bits),
                rounded_up(reading->chance).c_str());
  return watermark::payload_kind_name(reading->payload.kind) + std::string(" ") + reading->payload.value +
         text;
}

}  // namespace fieldmark::cli
