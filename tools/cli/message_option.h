#pragma once
#include <fieldmark/watermark/payload/payload_codec.h>

#include <optional>
#include <string>

#include "cli/command_line.h"
#include "cli/context.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace fieldmark::cli {

/// A message, as it is or as what it stands for; one of them.
struct MessageOption {
  std::string message, text, uuid, payload;
  bool given() const { return !(message.empty() && text.empty() && uuid.empty() && payload.empty()); }
};

/// Adds --message, --text, --uuid and --payload, which exclude each other. @param purpose  what is done with
/// the message: "Message ..."
void add_message_options(CommandLine& app, MessageOption& options, const std::string& purpose);

/// The message that was asked for. @throws UsageError if none is given, or it does not fit
watermark::Message message_of(const MessageOption& options, Index bits);

/// {kind, value} of a message that stands for something, else null.
Json payload_json(const watermark::Message& message);

/// The payload that logits tell, if any, see PayloadCodec::read().
std::optional<watermark::PayloadReading> read_payload(const std::vector<double>& logit);

/// {kind, value, corrected, chance}, or null.
Json payload_json(const std::optional<watermark::PayloadReading>& reading);

/// The same in words; why there is none where there is none.
std::string payload_text(const std::optional<watermark::PayloadReading>& reading, Index bits);

}  // namespace fieldmark::cli
