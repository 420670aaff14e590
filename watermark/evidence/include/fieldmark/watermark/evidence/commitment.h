#pragma once
#include <fieldmark/watermark/keys/key.h>
#include <fieldmark/watermark/payload/message.h>

#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// What an owner publishes, or has time-stamped, before the field: it fixes OWNER, key and message without
/// giving them away. SHA-256 of this text, each line ended by a line feed, so that `sha256sum` repeats it:
///   fieldmark commitment 1
///   owner SHA-256-OF-THE-OWNER-FILE
///   key 64-DIGITS
///   message NUMBER-OF-BITS HEXADECIMAL-DIGITS
/// @param owner_sha256  sha256_file_hex of the OWNER file   @throws ValueError if it is not 64 hexadecimal
/// digits
std::string commitment(std::string_view owner_sha256, const Key& key, const Message& message);

}  // namespace fieldmark::watermark
