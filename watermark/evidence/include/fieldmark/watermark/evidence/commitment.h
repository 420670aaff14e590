#pragma once
#include <fieldmark/watermark/keys/key.h>
#include <fieldmark/watermark/payload/message.h>

#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// Returns the commitment that an owner publishes or time-stamps before the field. It fixes OWNER, key and
/// message without revealing them: it is the SHA-256 of this text, in which a line feed ends each line, as
/// `sha256sum` computes it:
///   fieldmark claim 1
///   owner SHA-256-OF-THE-OWNER-FILE
///   key 64-DIGITS
///   message NUMBER-OF-BITS HEXADECIMAL-DIGITS
/// @param owner_sha256  sha256_file_hex of the OWNER file   @throws ValueError if it is not 64 hexadecimal
/// digits
std::string commitment(std::string_view owner_sha256, const Key& key, const Message& message);

}  // namespace fieldmark::watermark
