#pragma once
#include <fieldmark/watermark/payload/message.h>

#include <string>
#include <string_view>

namespace fieldmark::watermark {

/// Name of the algorithm in soft bindings, in the style of the C2PA soft binding algorithm list: reversed
/// domain, name and version. It is not on that list; a deployment registers its own.
inline constexpr std::string_view kSoftBindingAlgorithm = "org.fieldmark.keyed-cells.1";

/// Returns a C2PA soft-binding assertion as JSON for a manifest's definition. It states that the images carry
/// a message, by which a repository finds a stripped manifest.
///   {"label": "c2pa.soft-binding", "data": {"alg", "name", "blocks": [{"scope": {}, "value"}], "alg-params",
///   "bindingMetadata": {"description"}}}
/// value is base64 of the message's bits, most significant first, padded with zeros; alg-params is base64 of
/// {"bits": N, "claim": COMMITMENT}; the empty scope means the whole image. It holds neither key nor owner.
/// Source: C2PA Technical Specification 2.x, section "Soft Binding".
/// @param commitment  commitment()   @return canonical_json()
std::string soft_binding_json(const Message& message, std::string_view commitment);

}  // namespace fieldmark::watermark
