#pragma once
#include <fieldmark/watermark/payload/payload_codec.h>

#include <optional>
#include <string>

#include "cli/command_line.h"
#include "cli/context.h"

namespace fieldmark::cli {

/// The longest message that can hold a payload, bits; raw messages may be longer.
inline constexpr Index kMostPayloadBits = 256;

/// A raw message, or the payload that it encodes; at most one is given.
struct MessageOption {
  std::string message, text, uuid, payload;
  bool given() const { return !(message.empty() && text.empty() && uuid.empty() && payload.empty()); }
};

/// Adds --message, --text, --uuid and --payload, which exclude each other.
/// @param purpose  begins the help text: "Message ..."
void add_message_options(CommandLine& app, MessageOption& options, const std::string& purpose);

/// Returns the requested message. @throws UsageError if none is given, or it does not fit
watermark::Message message_of(const MessageOption& options, Index bits);

/// Returns {kind, value} of the payload that a message encodes, or null.
Json payload_json(const watermark::Message& message);

/// Returns the payload that evidence decodes to, if any, see PayloadCodec::read().
std::optional<watermark::PayloadReading> read_payload(const std::vector<double>& logit);

/// Returns {kind, value, corrected, chance}, or null.
Json payload_json(const std::optional<watermark::PayloadReading>& reading);

/// Returns the same in words, or the reason why there is no payload.
std::string payload_text(const std::optional<watermark::PayloadReading>& reading, Index bits);

}  // namespace fieldmark::cli
