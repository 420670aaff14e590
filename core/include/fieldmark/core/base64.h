#pragma once
#include <cstddef>
#include <span>
#include <string>

namespace fieldmark {

/// Encodes bytes as Base64 text with padding and without line breaks.   Source: RFC 4648, section 4
std::string to_base64(std::span<const std::byte> bytes);

}  // namespace fieldmark
